//! Rust source as tokens, enough of it to find which modules a file mentions and which of its code is for tests alone.

/// A word, or one other character; with its line.
#[derive(Clone, Debug, PartialEq)]
pub struct Token {
    pub text: String,
    pub line: usize,
}

/// Rust source without comments, literals and white space.
pub fn tokens(source: &str) -> Vec<Token> {
    let chars: Vec<char> = source.chars().collect();
    let at = |i: usize| chars.get(i).copied().unwrap_or('\0');
    let is_word = |c: char| c.is_alphanumeric() || c == '_';
    let mut found = Vec::new();
    let (mut i, mut line) = (0, 1);
    while i < chars.len() {
        let start = i;
        match at(i) {
            '/' if at(i + 1) == '/' => {
                while i < chars.len() && at(i) != '\n' {
                    i += 1;
                }
            }
            '/' if at(i + 1) == '*' => {
                let mut depth = 0;
                loop {
                    match (at(i), at(i + 1)) {
                        ('/', '*') => (depth, i) = (depth + 1, i + 2),
                        ('*', '/') => (depth, i) = (depth - 1, i + 2),
                        _ => i += 1,
                    }
                    if depth == 0 || i >= chars.len() {
                        break;
                    }
                }
            }
            '"' => i = end_of_string(&chars, i),
            // 'x' and '\n' are characters, 'a without an end is a lifetime.
            '\'' if at(i + 1) == '\\' => {
                i += 3;
                while i < chars.len() && at(i) != '\'' {
                    i += 1;
                }
                i += 1;
            }
            '\'' if at(i + 2) == '\'' => i += 3,
            '\'' => {
                i += 1;
                while is_word(at(i)) {
                    i += 1;
                }
            }
            c if is_word(c) => {
                while is_word(at(i)) {
                    i += 1;
                }
                let word: String = chars[start..i].iter().collect();
                let hashes = (i..).take_while(|&k| at(k) == '#').count();
                if ["r", "br", "cr"].contains(&word.as_str()) && at(i + hashes) == '"' {
                    i += hashes + 1;
                    while i < chars.len() && !(at(i) == '"' && (1..=hashes).all(|k| at(i + k) == '#')) {
                        i += 1;
                    }
                    i += 1 + hashes;
                } else {
                    found.push(Token { text: word, line });
                }
            }
            c => {
                if !c.is_whitespace() {
                    found.push(Token { text: c.to_string(), line });
                }
                i += 1;
            }
        }
        i = i.min(chars.len());
        line += chars[start..i].iter().filter(|&&c| c == '\n').count();
    }
    found
}

/// Index after the closing quote of the string that opens at `i`.
fn end_of_string(chars: &[char], mut i: usize) -> usize {
    i += 1;
    while i < chars.len() && chars[i] != '"' {
        i += if chars[i] == '\\' { 2 } else { 1 };
    }
    i + 1
}

/// True if the tokens from `at` on have these texts.
pub fn matches(tokens: &[Token], at: usize, texts: &[&str]) -> bool {
    texts.iter().enumerate().all(|(k, text)| tokens.get(at + k).is_some_and(|t| t.text == *text))
}

/// Index after the bracket that closes the one at `open`.
fn after_closing(tokens: &[Token], open: usize) -> usize {
    let mut depth = 0_usize;
    for (i, token) in tokens.iter().enumerate().skip(open) {
        match token.text.as_str() {
            "(" | "[" | "{" => depth += 1,
            ")" | "]" | "}" => depth -= 1,
            _ => {}
        }
        if depth == 0 {
            return i + 1;
        }
    }
    tokens.len()
}

/// Length of `#[cfg(test)]`, `#[cfg(all(test, …))]` or `#[test]` at `at`, if one is there.
fn test_attribute(tokens: &[Token], at: usize) -> Option<usize> {
    let is = |texts: &[&str]| matches(tokens, at, texts);
    let only_tests = is(&["#", "[", "test", "]"])
        || is(&["#", "[", "cfg", "(", "test", ")", "]"])
        || is(&["#", "[", "cfg", "(", "all", "(", "test"]);
    only_tests.then(|| after_closing(tokens, at + 1) - at)
}

/// The program without its tests, and the names of modules in files of their own that are tests.
pub fn without_tests(tokens: &[Token]) -> (Vec<Token>, Vec<String>) {
    if matches(tokens, 0, &["#", "!", "[", "cfg", "(", "test", ")", "]"]) {
        return (Vec::new(), Vec::new());
    }
    let (mut kept, mut modules) = (Vec::new(), Vec::new());
    let mut i = 0;
    while i < tokens.len() {
        let Some(length) = test_attribute(tokens, i) else {
            kept.push(tokens[i].clone());
            i += 1;
            continue;
        };
        i += length;
        while matches(tokens, i, &["#", "["]) {
            i = after_closing(tokens, i + 1);
        }
        // The item ends at its semicolon or with its body.
        let item = i;
        while i < tokens.len() && tokens[i].text != ";" && tokens[i].text != "{" {
            i = if ["(", "["].contains(&tokens[i].text.as_str()) { after_closing(tokens, i) } else { i + 1 };
        }
        if tokens.get(i).is_some_and(|t| t.text == ";")
            && let Some(module) = (item..i).find(|&k| tokens[k].text == "mod")
        {
            modules.push(tokens[module + 1].text.clone());
        }
        i = if tokens.get(i).is_some_and(|t| t.text == "{") { after_closing(tokens, i) } else { i + 1 };
    }
    (kept, modules)
}

/// Completes the path `prefix` by what stands at `at`, which may be a group: all paths that are named.
fn complete_paths(tokens: &[Token], mut at: usize, mut prefix: Vec<String>, into: &mut Vec<Vec<String>>) {
    while let Some(token) = tokens.get(at) {
        if token.text == "{" {
            let end = after_closing(tokens, at);
            let mut member = at + 1;
            while member + 1 < end {
                complete_paths(tokens, member, prefix.clone(), into);
                while member + 1 < end && tokens[member].text != "," {
                    member = if tokens[member].text == "{" { after_closing(tokens, member) } else { member + 1 };
                }
                member += 1;
            }
            return;
        }
        prefix.push(token.text.clone());
        if !matches(tokens, at + 1, &[":", ":"]) {
            break;
        }
        at += 3;
    }
    into.push(prefix);
}

/// Paths from the crate's root that the module `module` (its own path) mentions, with lines.
pub fn mentioned_paths(tokens: &[Token], module: &[String]) -> Vec<(Vec<String>, usize)> {
    let mut found = Vec::new();
    // The inline modules around, each with the depth of the brace that closes it.
    let mut inline: Vec<(usize, String)> = Vec::new();
    let mut depth = 0_usize;
    let mut i = 0;
    while i < tokens.len() {
        let line = tokens[i].line;
        let mut mention = |at: usize, prefix: Vec<String>| {
            let mut paths = Vec::new();
            complete_paths(tokens, at, prefix, &mut paths);
            found.extend(paths.into_iter().map(|path| (path, line)));
        };
        match tokens[i].text.as_str() {
            "mod" if tokens.get(i + 2).is_some_and(|t| t.text == "{") => {
                inline.push((depth, tokens[i + 1].text.clone()));
            }
            "{" => depth += 1,
            "}" => {
                depth = depth.saturating_sub(1);
                inline.pop_if(|(outer, _)| *outer == depth);
            }
            "crate" if matches(tokens, i + 1, &[":", ":"]) => mention(i + 3, Vec::new()),
            "super" => {
                let mut place: Vec<String> = module.iter().cloned().chain(inline.iter().map(|m| m.1.clone())).collect();
                let start = i;
                while matches(tokens, i, &["super", ":", ":"]) {
                    place.pop();
                    i += 3;
                }
                if i > start {
                    mention(i, place);
                }
                // The token at `i` has not been looked at yet, except if `super` stood alone.
                i += usize::from(i == start);
                continue;
            }
            _ => {}
        }
        i += 1;
    }
    found
}
