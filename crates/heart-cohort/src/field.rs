//! Fields of a scene by their dotted paths: `heart.inner.radius`, `pose.shift.1`, `defects.2.activity`. Arrays count from 1, as in
//! errors of a scene.

use serde_json::{Map, Value};

/// Returns the value at a path.
pub(crate) fn get<'a>(scene: &'a Value, path: &str) -> Option<&'a Value> {
    path.split('.').try_fold(scene, |at, name| match at {
        Value::Object(table) => table.get(name),
        Value::Array(array) => array.get(index(name)?),
        _ => None,
    })
}

/// Sets a value at a path and creates its tables; returns false if the path crosses another value.
pub(crate) fn set(scene: &mut Value, path: &str, value: Value) -> bool {
    let mut at = scene;
    for name in path.split('.') {
        if at.is_null() {
            *at = Value::Object(Map::new());
        }
        at = match at {
            Value::Object(table) => table.entry(name).or_insert(Value::Null),
            Value::Array(array) => match index(name).and_then(|k| array.get_mut(k)) {
                Some(entry) => entry,
                None => return false,
            },
            _ => return false,
        };
    }
    *at = value;
    true
}

/// Merges a table into another: tables entry by entry, other values are replaced. A table with one entry of another name replaces a
/// choice, such as `{ gain = 0.6 }` by `{ ejection_fraction = 0.4 }`.
pub(crate) fn lay_over(below: &mut Value, above: &Value) {
    let (Value::Object(old), Value::Object(new)) = (&mut *below, above) else {
        *below = above.clone();
        return;
    };
    let chosen_anew = old.len() == 1 && new.len() == 1 && !old.keys().eq(new.keys());
    if chosen_anew {
        *below = above.clone();
        return;
    }
    for (name, value) in new {
        lay_over(old.entry(name).or_insert(Value::Null), value);
    }
}

/// Returns the paths of all values in a table, which is at `path`, that are not tables.
pub(crate) fn leaves(value: &Value, path: &str) -> Vec<String> {
    let Value::Object(table) = value else {
        return vec![path.to_owned()];
    };
    let below = |name: &String| match path {
        "" => name.clone(),
        path => format!("{path}.{name}"),
    };
    let all = table.iter();
    all.flat_map(|(name, value)| leaves(value, &below(name)))
        .collect()
}

/// Whether a path is equal to another one or within it.
pub(crate) fn is_within(path: &str, other: &str) -> bool {
    path.strip_prefix(other)
        .is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
}

/// Whether two paths are equal or one is within the other.
pub(crate) fn overlap(path: &str, other: &str) -> bool {
    is_within(path, other) || is_within(other, path)
}

fn index(name: &str) -> Option<usize> {
    name.parse::<usize>().ok()?.checked_sub(1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn paths_lead_through_tables_and_arrays() {
        let mut scene = json!({ "a": { "b": 1 }, "c": [{ "d": 2 }, 3], "e": "name" });
        assert_eq!(get(&scene, "c.1.d"), Some(&json!(2)));
        for missing in ["a.x", "c.0", "c.3", "c.x", "e.f", ""] {
            assert_eq!(get(&scene, missing), None, "{missing}");
        }
        assert!(set(&mut scene, "c.2", json!(4)) && set(&mut scene, "x.y", json!(5)));
        assert_eq!(
            scene,
            json!({ "a": { "b": 1 }, "c": [{ "d": 2 }, 4], "e": "name", "x": { "y": 5 } })
        );
        assert!(!set(&mut scene, "e.f", json!(0)) && !set(&mut scene, "c.9", json!(0)));
    }

    #[test]
    fn the_upper_table_has_priority() {
        let mut below = json!({ "a": { "b": 1, "c": 2 }, "volume": { "gain": 0.6 }, "d": [1, 2] });
        lay_over(
            &mut below,
            &json!({ "a": { "b": 3 }, "volume": { "volumes": { "edv": 1 } }, "d": [4] }),
        );
        assert_eq!(
            below,
            json!({ "a": { "b": 3, "c": 2 }, "volume": { "volumes": { "edv": 1 } }, "d": [4] })
        );
        lay_over(
            &mut below,
            &json!({ "volume": { "volumes": { "edv": 2 } } }),
        );
        assert_eq!(below["volume"], json!({ "volumes": { "edv": 2 } }));
    }
}
