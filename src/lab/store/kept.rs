//! What a caller of the library keeps of a training of its own: its state's hash, and its state.

use super::checkpoint::{self, CheckpointError, Identity};
use super::hash;
use crate::chip::engine::Engine;
use crate::chip::state::State;
use crate::lab::store::ledger::LedgerRecord;
use crate::learn::outside::DrivenNetwork;

/// What has a state that can be hashed, kept and put back.
///
/// ```
/// use dalean::network::{HiddenWords, NetworkPlace};
/// use dalean::{Backend, Checkpointed, Config, DrivenNetwork, Sources};
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let config = Config::load(&Sources::default())?;
/// let experiment = config.experiment(4, 3, None)?;
/// let place = NetworkPlace { seed: 1, first_layer: 0, updates: 1 };
/// let (network, hardware) = (&experiment.network, &experiment.hardware);
/// let mut chip = DrivenNetwork::new(network, hardware, Backend::best(), place, HiddenWords::Routed)?;
/// let (kept, hash) = (chip.checkpoint("mine"), chip.state_hash());
/// let cells = chip.levels(0, "pp")?.len();
/// chip.load(0, "pp", &vec![7; cells])?;
/// assert_ne!(chip.state_hash(), hash);
/// chip.put_back("mine", &kept)?;
/// assert_eq!(chip.state_hash(), hash);
/// # Ok(())
/// # }
/// ```
pub trait Checkpointed {
    /// Hash of the state, in hexadecimal. What was read is forgotten.
    fn state_hash(&mut self) -> String;

    /// The state as safetensors; `of` says what it belongs to, and is asked for when it is put back.
    fn checkpoint(&mut self, of: &str) -> Vec<u8>;

    /// Puts a state back.
    ///
    /// # Errors
    /// When it is damaged or belongs to something else.
    fn put_back(&mut self, of: &str, bytes: &[u8]) -> Result<(), CheckpointError>;
}

impl<T: State> Checkpointed for T {
    fn state_hash(&mut self) -> String {
        hash::state(self)
    }

    fn checkpoint(&mut self, of: &str) -> Vec<u8> {
        checkpoint::write(self, Identity { run: of, data: "" })
    }

    fn put_back(&mut self, of: &str, bytes: &[u8]) -> Result<(), CheckpointError> {
        checkpoint::read(bytes, self, Identity { run: of, data: "" })
    }
}

/// What was counted on a network that is driven from outside, as the JSON of `ledger.json`: events by phase, layer, pathway
/// and operation, and cycles where the chip has a timing.
///
/// See [`Checkpointed`] for such a network.
#[must_use]
pub fn ledger_of(network: &DrivenNetwork) -> String {
    let engines: [&Engine; 1] = [network.driver().engine()];
    let ledger = LedgerRecord::of(&engines);
    serde_json::to_string(&ledger).expect("counts have a JSON form")
}
