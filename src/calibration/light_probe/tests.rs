use super::picture::photographed;
use super::*;
