//! Scene files to SceneDesc. Knows nothing of rendering.
