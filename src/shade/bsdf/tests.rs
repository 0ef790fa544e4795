//! Tests of all models together.
