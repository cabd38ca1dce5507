//! The fit of the camera's dual gamma (the curve itself is [`crate::imaging::DualGamma`]).
