//! How much a scene file may ask for: parameters and includes multiply, so that a small file could take all memory or
//! time.

/// Elements nested deeper than this in all files that include each other are a mistake.
const MAX_TOTAL_DEPTH: usize = 256;
/// Files that include each other deeper than this are a mistake.
const MAX_INCLUDE_DEPTH: usize = 128;
/// Most files that a scene may include, each counted as often as it is included.
const MAX_INCLUDES: usize = 10_000;
/// Most elements of a scene.
const MAX_ELEMENTS: usize = 20_000_000;
/// Longest value with parameters put in, in bytes.
const MAX_VALUE: usize = 1 << 20;
/// Most bytes of all values with parameters put in.
const MAX_SUBSTITUTED: usize = 1 << 28;

/// Parts of the limits that are used up. Its methods say which limit is exceeded.
#[derive(Debug, Default)]
pub(super) struct Usage {
    includes: usize,
    /// Bytes of values with parameters put in.
    substituted: usize,
    /// Elements that are open.
    depth: usize,
    elements: usize,
}

impl Usage {
    /// Counts an included file, with `open` files around it.
    pub(super) fn include(&mut self, open: usize) -> Result<(), String> {
        self.includes += 1;
        if self.includes > MAX_INCLUDES {
            return Err(format!("the scene includes more than {MAX_INCLUDES} files"));
        }
        if open >= MAX_INCLUDE_DEPTH {
            return Err(format!("files include each other more than {MAX_INCLUDE_DEPTH} levels deep"));
        }
        Ok(())
    }

    /// Counts an element that begins.
    pub(super) fn begin_element(&mut self) -> Result<(), String> {
        self.elements += 1;
        if self.elements > MAX_ELEMENTS {
            return Err(format!("the scene has more than {MAX_ELEMENTS} elements"));
        }
        if self.depth >= MAX_TOTAL_DEPTH {
            return Err(format!("elements are nested more than {MAX_TOTAL_DEPTH} levels deep"));
        }
        self.depth += 1;
        Ok(())
    }

    /// Counts an element that ends.
    pub(super) fn end_element(&mut self) {
        self.depth -= 1;
    }

    /// Counts a parameter's value of `added` bytes that is put behind `length` bytes.
    pub(super) fn substitute(&mut self, length: usize, added: usize) -> Result<(), String> {
        self.substituted += added;
        if length + added > MAX_VALUE {
            return Err(format!("with its parameters put in, this value is longer than {MAX_VALUE} bytes"));
        }
        if self.substituted > MAX_SUBSTITUTED {
            return Err(format!("the values of parameters put in are longer than {MAX_SUBSTITUTED} bytes together"));
        }
        Ok(())
    }
}
