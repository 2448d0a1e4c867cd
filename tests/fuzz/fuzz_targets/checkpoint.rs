//! Any bytes are a checkpoint of this run whose state hash is right, or an error. The first byte says how the rest is
//! used: as it is, or laid over a true checkpoint from some place on, so that the fuzzer gets past the header.
#![no_main]

use std::cell::RefCell;

use dalean::chip::crossbar::kernel::Backend;
use dalean::lab::config::{Sources, load};
use dalean::lab::data::{self, DataRoot};
use dalean::lab::run::{Machine, Session};
use libfuzzer_sys::fuzz_target;

const CONFIG: &str = "[data]\nset = \"xor\"\n[network]\nhidden = [3]\n[learning]\nepochs = 1\n\
                      [hw.cell]\nfloor_kind = \"absorbing\"\n[hw.write]\nresidual_bits = 4\n";

fn session() -> Session {
    let config = load(&Sources { experiment: Some(("fuzz", CONFIG)), ..Sources::default() });
    let config = config.expect("a valid configuration");
    let data = data::load(&config.source().expect("a known set"), &DataRoot::new("none"));
    let machine = Machine::new(Backend::best(), 1).expect("one thread");
    Session::new(&config, data.expect("built in"), machine).expect("it fits")
}

thread_local! {
    static SESSION: RefCell<(Session, Vec<u8>)> = {
        let mut session = session();
        let checkpoint = session.checkpoint();
        RefCell::new((session, checkpoint))
    };
}

fuzz_target!(|bytes: &[u8]| {
    SESSION.with_borrow_mut(|(session, whole)| {
        let bytes = match bytes {
            [mode, a, b, rest @ ..] if mode % 2 == 1 => {
                let mut laid = whole.clone();
                let at = usize::from(u16::from_le_bytes([*a, *b])) % laid.len();
                for (old, new) in laid[at..].iter_mut().zip(rest) {
                    *old = *new;
                }
                laid
            }
            _ => bytes.to_vec(),
        };
        if let Err(error) = session.restore(&bytes) {
            assert!(!error.to_string().is_empty());
        }
        session.restore(whole).expect("a true checkpoint is always read");
    });
});
