//! Integrators with parameters as one word: `bdpt:heuristic=power,max_depth=6`.

use crate::integrators::{IntegratorSpec, Params};

/// What was asked for, before anybody has looked whether it exists.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MethodText {
    /// As typed; names the method everywhere.
    pub label: String,
    /// The integrator's name.
    pub integrator: String,
    /// Keys and values.
    pub params: Vec<(String, String)>,
}

/// A method that takes part: an integrator with all its parameters.
#[derive(Clone)]
pub struct Contender {
    /// What it is called in tables.
    pub label: String,
    /// Integrator.
    pub spec: &'static IntegratorSpec,
    /// Parameters.
    pub params: Params,
}

impl Contender {
    /// Parameters as text, in the order of declaration.
    pub fn parameters(&self) -> String {
        let pairs: Vec<String> = self.params.pairs().into_iter().map(|(k, v)| format!("{k}={v}")).collect();
        pairs.join(" ")
    }
}

/// Reads a list of methods: names, each with `:key=value` and further `,key=value`. A comma also stands inside of values
/// (`techniques=all,-0:*`): what begins with a letter and is no `key=value` begins a new method, all else goes on with the
/// one before.
///
/// # Errors
/// What was expected.
pub fn parse_methods(text: &str) -> Result<Vec<MethodText>, String> {
    let expected = |what: &str| format!("\"{what}\": expected NAME or NAME:key=value, separated by commas");
    let mut methods: Vec<MethodText> = vec![];
    for piece in text.split(',') {
        let key_value = |text: &str| text.split_once('=').map(|(k, v)| (k.to_owned(), v.to_owned()));
        let word = piece.starts_with(|c: char| c.is_ascii_alphabetic());
        let before_colon = piece.split(':').next().unwrap_or_default();
        if word && !before_colon.contains('=') {
            let (name, first) = piece.split_once(':').map_or((piece, None), |(n, p)| (n, Some(p)));
            let params = match first {
                Some(p) => vec![key_value(p).ok_or_else(|| expected(piece))?],
                None => vec![],
            };
            methods.push(MethodText { label: piece.to_owned(), integrator: name.to_owned(), params });
            continue;
        }
        let method = methods.last_mut().ok_or_else(|| expected(piece))?;
        match (word, key_value(piece), method.params.last_mut()) {
            (true, Some(pair), _) => method.params.push(pair),
            (false, _, Some((_, value))) if !piece.is_empty() => {
                value.push(',');
                value.push_str(piece);
            }
            _ => return Err(expected(piece)),
        }
        method.label.push(',');
        method.label.push_str(piece);
    }
    let mut labels: Vec<&str> = methods.iter().map(|m| m.label.as_str()).collect();
    labels.sort_unstable();
    match labels.windows(2).find(|w| w[0] == w[1]) {
        Some(w) => Err(format!("{} is named twice", w[0])),
        None => Ok(methods),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commas_separate_methods_parameters_and_parts_of_values() {
        let found = parse_methods("path,bdpt:techniques=all,-0:*,+2:3,max_depth=6,light").unwrap();
        let labels: Vec<&str> = found.iter().map(|m| m.label.as_str()).collect();
        assert_eq!(labels, ["path", "bdpt:techniques=all,-0:*,+2:3,max_depth=6", "light"]);
        let pair = |k: &str, v: &str| (k.to_owned(), v.to_owned());
        assert_eq!(found[1].integrator, "bdpt");
        assert_eq!(found[1].params, [pair("techniques", "all,-0:*,+2:3"), pair("max_depth", "6")]);
        assert!(found[0].params.is_empty() && found[2].params.is_empty());
    }

    #[test]
    fn slips_are_explained() {
        for bad in ["", "-0:*", "path,", "path:max_depth", "a=b", "path,-1", "path,path"] {
            assert!(parse_methods(bad).is_err(), "{bad}");
        }
    }
}
