//! Checks of a whole scene that no single element shows: nothing to see, nothing that shines, an empty film.
