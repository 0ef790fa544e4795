//! Declaration of a parameter: names, kind, default, allowed values and texts; and how its values are read.

use crate::mis::Techniques;
use std::fmt;

/// A parameter's kind, default and allowed values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ParamDefault {
    /// A whole number.
    Int {
        /// Default.
        default: i64,
        /// Smallest allowed value.
        min: i64,
        /// Largest allowed value.
        max: i64,
    },
    /// A real number.
    Float {
        /// Default.
        default: f64,
        /// Smallest allowed value.
        min: f64,
        /// Largest allowed value.
        max: f64,
    },
    /// A part of a whole, written as `0.25`, `1/4` or `25%`.
    Fraction {
        /// Default.
        default: f64,
        /// Smallest allowed value.
        min: f64,
        /// Largest allowed value.
        max: f64,
    },
    /// A whole number, or `auto` (the default): the integrator decides.
    AutoInt {
        /// Smallest allowed number.
        min: i64,
        /// Largest allowed number.
        max: i64,
    },
    /// A fraction, or `auto` (the default): the integrator decides.
    AutoFraction {
        /// Smallest allowed fraction.
        min: f64,
        /// Largest allowed fraction.
        max: f64,
    },
    /// `true` or `false`.
    Bool(bool),
    /// One of several words.
    Choice {
        /// Default.
        default: &'static str,
        /// Allowed words.
        choices: &'static [Choice],
    },
    /// A list of techniques, see [`Techniques::parse`].
    Techniques(&'static str),
}

/// An allowed word of a [`ParamDefault::Choice`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Choice {
    /// The word.
    pub name: &'static str,
    /// Earlier words for it.
    pub aliases: &'static [&'static str],
    /// Meaning.
    pub meaning: &'static str,
}

/// An earlier name of a parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ParamAlias {
    /// The earlier name.
    pub name: &'static str,
    /// How values were written under that name.
    pub values: AliasValues,
}

/// How values are read that are given under an earlier name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AliasValues {
    /// As under the present name.
    Same,
    /// A whole number counts parts of which so many make one; any other number is read as under the present name.
    Parts(u32),
    /// Zero stands for `auto`; any other number is read as under the present name.
    ZeroIsAuto,
}

/// Declaration of a parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ParamSpec {
    /// Key.
    pub name: &'static str,
    /// Earlier names, which still work.
    pub aliases: &'static [ParamAlias],
    /// Kind, default and allowed values.
    pub default: ParamDefault,
    /// Unit of a number; empty for other kinds.
    pub unit: &'static str,
    /// Meaning in one line of at most 80 characters.
    pub short: &'static str,
    /// Meaning in full: what it does, when to change it, published values. Paragraphs are separated by a blank line.
    pub long: &'static str,
}

impl ParamSpec {
    /// `name` is the parameter's name or one of its earlier names.
    pub fn is_called(&self, name: &str) -> bool {
        self.name == name || self.aliases.iter().any(|a| a.name == name)
    }

    /// Allowed values in words, without the default.
    pub fn values(&self) -> String {
        let unit = if self.unit.is_empty() { String::new() } else { format!(" {}", self.unit) };
        match self.default {
            ParamDefault::Int { min, max, .. } => format!("whole number {min} … {max}{unit}"),
            ParamDefault::Float { min, max, .. } => format!("number {min} … {max}{unit}"),
            ParamDefault::Fraction { min, max, .. } => {
                format!("fraction {min} … {max}{unit} (such as 0.25, 1/4 or 25%)")
            }
            ParamDefault::AutoInt { min, max } => format!("auto or whole number {min} … {max}{unit}"),
            ParamDefault::AutoFraction { min, max } => {
                format!("auto or fraction {min} … {max}{unit} (such as 0.25, 1/4 or 25%)")
            }
            ParamDefault::Bool(_) => "true or false".into(),
            ParamDefault::Choice { choices, .. } => choices.iter().map(|c| c.name).collect::<Vec<_>>().join(" or "),
            ParamDefault::Techniques(_) => "list such as all,-0:*,+2:3 of light:eye vertices".into(),
        }
    }

    /// The default, as it would be written.
    pub fn default_text(&self) -> String {
        self.default_value().to_string()
    }

    pub(super) fn default_value(&self) -> Value {
        match self.default {
            ParamDefault::Int { default, .. } => Value::Int(default),
            ParamDefault::Float { default, .. } | ParamDefault::Fraction { default, .. } => Value::Float(default),
            ParamDefault::AutoInt { .. } | ParamDefault::AutoFraction { .. } => Value::Auto,
            ParamDefault::Bool(default) => Value::Bool(default),
            ParamDefault::Choice { default, .. } => Value::Choice(default),
            ParamDefault::Techniques(default) => Value::Techniques(default.into()),
        }
    }

    /// Reads a value given under the present name.
    pub(super) fn parse(&self, text: &str) -> Option<Value> {
        let int = |min: i64, max: i64| text.parse().ok().filter(|v| (min..=max).contains(v)).map(Value::Int);
        let within = |v: Option<f64>, min: f64, max: f64| v.filter(|v| (min..=max).contains(v)).map(Value::Float);
        match self.default {
            ParamDefault::AutoInt { .. } | ParamDefault::AutoFraction { .. } if text == "auto" => Some(Value::Auto),
            ParamDefault::Int { min, max, .. } | ParamDefault::AutoInt { min, max } => int(min, max),
            ParamDefault::Float { min, max, .. } => within(text.parse().ok(), min, max),
            ParamDefault::Fraction { min, max, .. } | ParamDefault::AutoFraction { min, max } => {
                within(parse_fraction(text), min, max)
            }
            ParamDefault::Bool(_) => text.parse().ok().map(Value::Bool),
            ParamDefault::Choice { choices, .. } => {
                let found = choices.iter().find(|c| c.name == text || c.aliases.contains(&text));
                found.map(|c| Value::Choice(c.name))
            }
            ParamDefault::Techniques(_) => Techniques::parse(text).ok().map(|_| Value::Techniques(text.into())),
        }
    }

    /// Reads a value given under the present or an earlier name.
    pub(super) fn parse_as(&self, name: &str, text: &str) -> Option<Value> {
        let alias = self.aliases.iter().find(|a| a.name == name && a.name != self.name);
        match (alias.map(|a| a.values), text.parse::<i64>()) {
            (Some(AliasValues::Parts(parts)), Ok(count)) => self.parse(&(count as f64 / f64::from(parts)).to_string()),
            (Some(AliasValues::ZeroIsAuto), Ok(0)) => Some(Value::Auto),
            _ => self.parse(text),
        }
    }
}

/// A number written as a decimal, as a ratio of two, or in percent.
fn parse_fraction(text: &str) -> Option<f64> {
    let number = |t: &str| t.parse::<f64>().ok();
    if let Some(percent) = text.strip_suffix('%') {
        return number(percent).map(|v| v / 100.0);
    }
    match text.split_once('/') {
        Some((numerator, denominator)) => Some(number(numerator)? / number(denominator)?),
        None => number(text),
    }
}

/// A parameter's value.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Value {
    /// Left to the integrator.
    Auto,
    Int(i64),
    Float(f64),
    Bool(bool),
    Choice(&'static str),
    Techniques(String),
}

impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Value::Auto => f.write_str("auto"),
            Value::Int(v) => write!(f, "{v}"),
            Value::Float(v) => write!(f, "{v}"),
            Value::Bool(v) => write!(f, "{v}"),
            Value::Choice(v) => f.write_str(v),
            Value::Techniques(v) => f.write_str(v),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fractions_are_decimals_ratios_or_percents() {
        let good = [("0.25", 0.25), ("1/4", 0.25), ("25%", 0.25), ("0.4%", 0.004), ("1", 1.0), ("1e-3", 1e-3)];
        for (text, value) in good {
            assert_eq!(parse_fraction(text), Some(value), "{text}");
        }
        for bad in ["", "%", "/", "1/", "/4", "1/4/2", "a/2", "1/4%", "half"] {
            assert_eq!(parse_fraction(bad), None, "{bad}");
        }
    }
}
