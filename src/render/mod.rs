//! The driver: iterations until a budget is used up.
