//! Parameters of integrators: declared once with default and meaning, set by `-p key=value` or a scene's `<integrator>`
//! block.

pub(super) mod presampled;
pub(super) mod shared;
mod spec;

pub use spec::{AliasValues, Choice, ParamAlias, ParamDefault, ParamSpec};

use super::IntegratorSpec;
use crate::mis::Techniques;
use crate::scene::diag::nearest;
use spec::Value;

/// A parameter that cannot be set as asked.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ParamError {
    /// No such parameter.
    #[error("{integrator} has no parameter \"{name}\"{}", nearest.map(|n| format!("; did you mean \"{n}\"?")).unwrap_or_default())]
    Unknown {
        /// Integrator.
        integrator: &'static str,
        /// Given name.
        name: String,
        /// The nearest name that exists.
        nearest: Option<&'static str>,
    },
    /// Not an allowed value.
    #[error("{name} = {value}: expected {expected}")]
    Value {
        /// Given name of the parameter.
        name: String,
        /// Given value.
        value: String,
        /// Allowed values.
        expected: String,
    },
}

/// A parameter was set by an earlier name, or to an earlier word for a value.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Renamed {
    /// Given name.
    pub given_name: String,
    /// Given value.
    pub given_value: String,
    /// Present name.
    pub name: &'static str,
    /// The value as it is written now.
    pub value: String,
}

impl std::fmt::Display for Renamed {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        let Renamed { given_name, given_value, name, value } = self;
        if given_name == name {
            write!(f, "`{given_name}={given_value}` is now written `{name}={value}`")
        } else {
            write!(f, "parameter `{given_name}` is now called `{name}`: `{name}={value}`")
        }
    }
}

/// Values of all parameters of one integrator.
#[derive(Clone, Debug, PartialEq)]
pub struct Params {
    integrator: &'static str,
    specs: Vec<&'static ParamSpec>,
    values: Vec<Value>,
}

impl Params {
    /// The defaults.
    pub fn defaults(spec: &IntegratorSpec) -> Params {
        let specs: Vec<&'static ParamSpec> = spec.params().collect();
        let values = specs.iter().map(|p| p.default_value()).collect();
        Params { integrator: spec.name, specs, values }
    }

    /// The defaults, but for some names (present or earlier ones) and values.
    ///
    /// # Errors
    /// See [`Params::set`].
    pub fn with<S: AsRef<str>>(spec: &IntegratorSpec, pairs: &[(S, S)]) -> Result<Params, ParamError> {
        let mut params = Params::defaults(spec);
        for (name, value) in pairs {
            params.set(name.as_ref(), value.as_ref())?;
        }
        Ok(params)
    }

    /// Sets one parameter from text, by its name or an earlier one; in the latter case returns what it is called now.
    ///
    /// # Errors
    /// If it does not exist or may not have that value.
    pub fn set(&mut self, name: &str, value: &str) -> Result<Option<Renamed>, ParamError> {
        let Some(i) = self.position(name) else {
            return Err(ParamError::Unknown {
                integrator: self.integrator,
                name: name.into(),
                nearest: self.nearest(name),
            });
        };
        let spec = self.specs[i];
        self.values[i] = spec.parse_as(name, value).ok_or_else(|| ParamError::Value {
            name: name.into(),
            value: value.into(),
            expected: match name == spec.name {
                true => format!("{}, default {}", spec.values(), spec.default_text()),
                false => format!("a value of `{}`: {}, default {}", spec.name, spec.values(), spec.default_text()),
            },
        })?;
        let word = matches!(&self.values[i], Value::Choice(word) if *word != value);
        Ok((name != spec.name || word).then(|| Renamed {
            given_name: name.into(),
            given_value: value.into(),
            name: spec.name,
            value: self.values[i].to_string(),
        }))
    }

    /// The present name of the parameter one of whose names is nearest to `name`.
    fn nearest(&self, name: &str) -> Option<&'static str> {
        let names = |p: &'static ParamSpec| std::iter::once(p.name).chain(p.aliases.iter().map(|a| a.name));
        let near = nearest(name, self.specs.iter().copied().flat_map(names))?;
        self.position(near).map(|i| self.specs[i].name)
    }

    fn position(&self, name: &str) -> Option<usize> {
        // A present name is looked for first: it may be an earlier name of another parameter.
        let present = self.specs.iter().position(|p| p.name == name);
        present.or_else(|| self.specs.iter().position(|p| p.is_called(name)))
    }

    fn get(&self, name: &str) -> &Value {
        // Integrators ask for what they declare; anything else is a slip in the program.
        let i = self.specs.iter().position(|p| p.name == name);
        &self.values[i.unwrap_or_else(|| panic!("undeclared parameter {name}"))]
    }

    /// A whole number.
    pub fn int(&self, name: &str) -> i64 {
        match self.get(name) {
            Value::Int(v) => *v,
            other => panic!("parameter {name} is {other:?}"),
        }
    }

    /// A whole number, or none if it is `auto`.
    pub fn auto_int(&self, name: &str) -> Option<i64> {
        match self.get(name) {
            Value::Auto => None,
            _ => Some(self.int(name)),
        }
    }

    /// A real number or a fraction.
    pub fn float(&self, name: &str) -> f64 {
        match self.get(name) {
            Value::Float(v) => *v,
            other => panic!("parameter {name} is {other:?}"),
        }
    }

    /// A fraction, or none if it is `auto`.
    pub fn auto_float(&self, name: &str) -> Option<f64> {
        match self.get(name) {
            Value::Auto => None,
            _ => Some(self.float(name)),
        }
    }

    /// True or false.
    pub fn bool(&self, name: &str) -> bool {
        match self.get(name) {
            Value::Bool(v) => *v,
            other => panic!("parameter {name} is {other:?}"),
        }
    }

    /// A word.
    pub fn choice(&self, name: &str) -> &'static str {
        match self.get(name) {
            Value::Choice(v) => v,
            other => panic!("parameter {name} is {other:?}"),
        }
    }

    /// A choice is this word, which the parameter declares.
    pub fn is(&self, name: &str, word: &str) -> bool {
        let spec = self.specs.iter().find(|p| p.name == name);
        let declares = |c: &Choice| c.name == word;
        match spec.map(|p| p.default) {
            // A slip in the program would otherwise never be true.
            Some(ParamDefault::Choice { choices, .. }) if choices.iter().any(declares) => self.choice(name) == word,
            _ => panic!("parameter {name} has no choice {word}"),
        }
    }

    /// A set of techniques.
    pub fn techniques(&self, name: &str) -> Techniques {
        match self.get(name) {
            // The text was parsed when it was set; defaults are tested.
            Value::Techniques(v) => Techniques::parse(v).unwrap_or_else(|e| panic!("parameter {name}: {e}")),
            other => panic!("parameter {name} is {other:?}"),
        }
    }

    /// Names and values, in the order of declaration.
    pub fn pairs(&self) -> Vec<(&'static str, String)> {
        self.specs.iter().zip(&self.values).map(|(s, v)| (s.name, v.to_string())).collect()
    }
}

#[cfg(test)]
mod tests;
