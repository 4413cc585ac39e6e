//! Places of fields in a text.

use std::collections::BTreeMap;

use heart_phantom::scene::{locate, read_toml};

#[test]
fn fields_are_located_in_any_notation() {
    let text = "members = 3\n[vary]\na.b = 1\n\"c.d\" = 2\n[[cases]]\nname = \"x\"\n[[cases]]\n name = \"y\"\n[vary.e]\nf = 3\n";
    for (field, line, is_there) in [
        ("members", 1, true),
        ("vary.a.b", 3, true),
        ("vary.c.d", 4, true),
        ("cases.1.name", 6, true),
        ("cases.2.name", 8, true),
        ("vary.e.f", 10, true),
        ("vary.e.g", 9, false),
    ] {
        let found = locate(text, field).map(|([line, _], is_there)| (line, is_there));
        assert_eq!(found, Some((line, is_there)), "{field}");
    }
    assert_eq!(locate(text, "nothing"), None);
    assert_eq!(locate("= no", "members"), None);
    // columns count characters, not bytes
    let twice = read_toml::<BTreeMap<String, u64>>("a = 1\n\"\u{e9}\" = -1");
    let finding = twice.unwrap_err();
    assert_eq!((finding.place, &finding.given[..]), (Some([2, 7]), "-1"));
}
