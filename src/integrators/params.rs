//! Parameters of integrators: declared once with default and meaning, set by `-p key=value` or a scene's `<integrator>` block.

use crate::mis::Techniques;
use crate::scene::diag::nearest;

/// A parameter's kind and default.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ParamDefault {
    /// A whole number between two bounds.
    Int(i64, i64, i64),
    /// Yes or no.
    Bool(bool),
    /// One of several words.
    Choice(&'static str, &'static [&'static str]),
    /// A list of techniques, see [`Techniques::parse`].
    Techniques(&'static str),
}

/// Declaration of a parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ParamSpec {
    /// Key.
    pub name: &'static str,
    /// Meaning, with unit.
    pub about: &'static str,
    /// Default and allowed values.
    pub default: ParamDefault,
}

impl ParamDefault {
    /// Allowed values and default, for people.
    pub fn describe(&self) -> String {
        match self {
            ParamDefault::Int(d, lo, hi) => format!("whole number {lo} … {hi}, default {d}"),
            ParamDefault::Bool(d) => format!("true or false, default {d}"),
            ParamDefault::Choice(d, all) => format!("{}, default {d}", all.join(" or ")),
            ParamDefault::Techniques(d) => format!("a list such as all,-0:*,+2:3 of light:eye vertices, default {d}"),
        }
    }

    fn value(&self) -> Value {
        match *self {
            ParamDefault::Int(d, ..) => Value::Int(d),
            ParamDefault::Bool(d) => Value::Bool(d),
            ParamDefault::Choice(d, _) => Value::Choice(d),
            ParamDefault::Techniques(d) => Value::Techniques(d.into()),
        }
    }

    fn parse(&self, text: &str) -> Option<Value> {
        match *self {
            ParamDefault::Int(_, lo, hi) => text.parse().ok().filter(|v| (lo..=hi).contains(v)).map(Value::Int),
            ParamDefault::Bool(_) => text.parse().ok().map(Value::Bool),
            ParamDefault::Choice(_, all) => all.iter().find(|c| **c == text).map(|c| Value::Choice(c)),
            ParamDefault::Techniques(_) => Techniques::parse(text).ok().map(|_| Value::Techniques(text.into())),
        }
    }
}

#[derive(Clone, Debug, PartialEq)]
enum Value {
    Int(i64),
    Bool(bool),
    Choice(&'static str),
    Techniques(String),
}

/// A parameter that cannot be set as asked.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ParamError {
    /// No such parameter.
    #[error("{integrator} has no parameter \"{name}\"{}", nearest.map(|n| format!("; did you mean \"{n}\"?")).unwrap_or_default())]
    Unknown {
        /// Integrator.
        integrator: &'static str,
        /// What was asked for.
        name: String,
        /// The nearest that exists.
        nearest: Option<&'static str>,
    },
    /// Not an allowed value.
    #[error("{name} = {value}: expected {expected}")]
    Value {
        /// Parameter.
        name: &'static str,
        /// What was asked for.
        value: String,
        /// What is allowed.
        expected: String,
    },
}

/// Values of all parameters of one integrator.
#[derive(Clone, Debug, PartialEq)]
pub struct Params {
    integrator: &'static str,
    specs: &'static [ParamSpec],
    values: Vec<Value>,
}

impl Params {
    /// The defaults.
    pub fn defaults(spec: &super::IntegratorSpec) -> Params {
        let values = spec.params.iter().map(|p| p.default.value()).collect();
        Params { integrator: spec.name, specs: spec.params, values }
    }

    /// Sets one parameter from text.
    ///
    /// # Errors
    /// If it does not exist or may not have that value.
    pub fn set(&mut self, name: &str, value: &str) -> Result<(), ParamError> {
        let Some(i) = self.specs.iter().position(|p| p.name == name) else {
            return Err(ParamError::Unknown {
                integrator: self.integrator,
                name: name.into(),
                nearest: nearest(name, self.specs.iter().map(|p| p.name)),
            });
        };
        let spec = &self.specs[i];
        self.values[i] = spec.default.parse(value).ok_or_else(|| ParamError::Value {
            name: spec.name,
            value: value.into(),
            expected: spec.default.describe(),
        })?;
        Ok(())
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

    /// Yes or no.
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
        let text = |v: &Value| match v {
            Value::Int(v) => v.to_string(),
            Value::Bool(v) => v.to_string(),
            Value::Choice(v) => (*v).to_string(),
            Value::Techniques(v) => v.clone(),
        };
        self.specs.iter().zip(&self.values).map(|(s, v)| (s.name, text(v))).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::integrators::{REGISTRY, find};

    #[test]
    fn every_integrator_declares_its_parameters_well() {
        for spec in REGISTRY {
            assert!(std::ptr::eq(find(spec.name).unwrap(), *spec));
            let mut params = Params::defaults(spec);
            for (name, value) in params.pairs() {
                params.set(name, &value).unwrap();
            }
            assert_eq!(params, Params::defaults(spec));
            // Building asks for every parameter by name and kind: an undeclared one would panic here.
            (spec.build)(&params);
        }
    }

    #[test]
    fn slips_are_explained() {
        let mut params = Params::defaults(REGISTRY[0]);
        let unknown = params.set("max_dept", "3").unwrap_err();
        assert!(unknown.to_string().contains("did you mean \"max_depth\""), "{unknown}");
        let value = params.set("max_depth", "many").unwrap_err();
        assert!(value.to_string().contains("expected whole number"), "{value}");
    }
}
