//! Fusion of exact views of a rigid, posed body.
