//! Ray queries behind one trait.
