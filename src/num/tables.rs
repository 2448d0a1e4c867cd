//! Tables: floats in, integers out, at load only.
