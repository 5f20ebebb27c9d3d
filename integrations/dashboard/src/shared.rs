//! State that all connections use.

use crate::connections::Open;
use crate::gate::Gate;
use crate::guests::Guests;
use crate::hub::Hub;
use crate::meshes::Meshes;
use crate::options::Settings;
use crate::token::Token;

/// State that all connections use.
#[derive(Debug)]
pub(crate) struct Shared {
    pub(crate) hubs: Vec<Hub>,
    pub(crate) meshes: Meshes,
    pub(crate) settings: Settings,
    pub(crate) token: Token,
    pub(crate) guests: Guests,
    pub(crate) gate: Gate,
    pub(crate) open: Open,
}
