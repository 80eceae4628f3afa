//! Properties of the PLY reader.
