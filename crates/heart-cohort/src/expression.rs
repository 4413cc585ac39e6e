//! Constraints between fields: `heart.outer.radius > heart.inner.radius + 0.6`.
//!
//! ```text
//! constraint = sum ("<" | "<=" | ">" | ">=") sum
//! sum        = product {("+" | "-") product}
//! product    = factor {("*" | "/") factor}
//! factor     = number | field | "-" factor | "(" sum ")"
//! ```

/// A comparison of two sums over fields.
#[derive(Debug, Clone)]
pub(crate) struct Constraint {
    text: String,
    left: Sum,
    compares: fn(&f64, &f64) -> bool,
    right: Sum,
}

#[derive(Debug, Clone)]
enum Sum {
    Number(f64),
    Field(String),
    Minus(Box<Sum>),
    Of(Box<Sum>, char, Box<Sum>),
}

/// Deepest nesting of brackets and signs, and longest text: the depth of a sum is its length.
const MOST_DEEP: usize = 50;
pub(crate) const MOST_BYTES: usize = 2000;

impl Constraint {
    /// Parses a constraint of at most [`MOST_BYTES`]; returns a message if it is invalid.
    pub(crate) fn parse(text: &str) -> Result<Self, String> {
        let mut reader = Reader {
            text,
            at: 0,
            deep: 0,
        };
        let left = reader.sum()?;
        let compares = match reader.next() {
            Some('<') if reader.takes('=') => f64::le,
            Some('<') => f64::lt,
            Some('>') if reader.takes('=') => f64::ge,
            Some('>') => f64::gt,
            _ => return Err(reader.expected("one of < <= > >=")),
        };
        let right = reader.sum()?;
        match reader.peek() {
            None => Ok(Self {
                text: text.trim().to_owned(),
                left,
                compares,
                right,
            }),
            Some(_) => Err(reader.expected("the end, or one of + - * /")),
        }
    }

    pub(crate) fn text(&self) -> &str {
        &self.text
    }

    pub(crate) fn fields(&self) -> Vec<&str> {
        let mut fields = Vec::new();
        self.left.add_fields(&mut fields);
        self.right.add_fields(&mut fields);
        fields
    }

    /// Returns whether the constraint is met; NaN, the value of a field that is not a number, never meets it.
    pub(crate) fn holds(&self, value: &impl Fn(&str) -> f64) -> bool {
        (self.compares)(&self.left.value(value), &self.right.value(value))
    }
}

impl Sum {
    fn value(&self, of: &impl Fn(&str) -> f64) -> f64 {
        match self {
            Self::Number(number) => *number,
            Self::Field(field) => of(field),
            Self::Minus(sum) => -sum.value(of),
            Self::Of(left, operation, right) => {
                let (left, right) = (left.value(of), right.value(of));
                match operation {
                    '+' => left + right,
                    '-' => left - right,
                    '*' => left * right,
                    // A quotient by zero meets no comparison.
                    _ if right == 0.0 => f64::NAN,
                    _ => left / right,
                }
            }
        }
    }

    fn add_fields<'a>(&'a self, fields: &mut Vec<&'a str>) {
        match self {
            Self::Number(_) => {}
            Self::Field(field) => fields.push(field),
            Self::Minus(sum) => sum.add_fields(fields),
            Self::Of(left, _, right) => {
                left.add_fields(fields);
                right.add_fields(fields);
            }
        }
    }
}

struct Reader<'a> {
    text: &'a str,
    at: usize,
    deep: usize,
}

impl<'a> Reader<'a> {
    fn rest(&self) -> &'a str {
        &self.text[self.at..]
    }

    fn peek(&mut self) -> Option<char> {
        self.at = self.text.len() - self.rest().trim_start().len();
        self.rest().chars().next()
    }

    fn next(&mut self) -> Option<char> {
        let next = self.peek()?;
        self.at += next.len_utf8();
        Some(next)
    }

    /// Consumes the given character if it is next.
    fn takes(&mut self, wanted: char) -> bool {
        let is_there = self.rest().starts_with(wanted);
        self.at += if is_there { wanted.len_utf8() } else { 0 };
        is_there
    }

    fn expected(&self, what: &str) -> String {
        let from = self.text[..self.at].chars().count();
        format!("expected {what} near character {from}")
    }

    fn sum(&mut self) -> Result<Sum, String> {
        self.chain(&['+', '-'], Self::product)
    }

    fn product(&mut self) -> Result<Sum, String> {
        self.chain(&['*', '/'], Self::factor)
    }

    fn chain(
        &mut self,
        operations: &[char],
        part: fn(&mut Self) -> Result<Sum, String>,
    ) -> Result<Sum, String> {
        let mut left = part(self)?;
        while let Some(operation) = self.peek().filter(|next| operations.contains(next)) {
            self.next();
            left = Sum::Of(Box::new(left), operation, Box::new(part(self)?));
        }
        Ok(left)
    }

    fn factor(&mut self) -> Result<Sum, String> {
        self.deep += 1;
        if self.deep > MOST_DEEP {
            return Err(format!("more than {MOST_DEEP} nested brackets"));
        }
        let factor = match self.peek() {
            Some('-') => {
                self.next();
                Sum::Minus(Box::new(self.factor()?))
            }
            Some('(') => {
                self.next();
                let sum = self.sum()?;
                if self.next() != Some(')') {
                    return Err(self.expected("a closing bracket"));
                }
                sum
            }
            Some(c) if c.is_ascii_digit() || c == '.' => self.number()?,
            Some(c) if c.is_ascii_alphabetic() => {
                Sum::Field(self.word(|c| c.is_ascii_alphanumeric() || "._".contains(c)))
            }
            _ => return Err(self.expected("a number, a field or a bracket")),
        };
        self.deep -= 1;
        Ok(factor)
    }

    fn number(&mut self) -> Result<Sum, String> {
        let mut last = ' ';
        let word = self.word(|c| {
            let is_part =
                c.is_ascii_alphanumeric() || c == '.' || ("+-".contains(c) && "eE".contains(last));
            last = c;
            is_part
        });
        let number = word.parse().ok().filter(|number: &f64| number.is_finite());
        (number.map(Sum::Number)).ok_or_else(|| format!("`{word}` is not a number"))
    }

    fn word(&mut self, mut is_part: impl FnMut(char) -> bool) -> String {
        let length = self
            .rest()
            .find(|c| !is_part(c))
            .unwrap_or(self.rest().len());
        let word = self.rest()[..length].to_owned();
        self.at += length;
        word
    }
}
