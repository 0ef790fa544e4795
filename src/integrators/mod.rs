//! Rendering algorithms: one folder and one registry line each.
