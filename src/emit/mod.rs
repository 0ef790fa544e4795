//! Both ends of a path: lights and cameras.
