//! Invalid descriptions and archives of FMUs.

mod archives;
mod descriptions;
mod fixture;

use std::fs;
use std::path::Path;

use fixture::{MAP, SIMULATION, description, library_path, map, packed, servo};

use super::*;
use crate::external::External;
