//! SceneDesc to PreparedScene: immutable, Sync, in world space.
