//! Any bytes are a stream of environments that a policy is shown, or a checkpoint of a policy, or an error. The first byte says
//! which of both, and how the rest is used: as it is, or laid over a true file from some place on.
#![no_main]

use std::cell::RefCell;
use std::sync::{Arc, Mutex};

use dalean::chip::crossbar::kernel::Backend;
use dalean::lab::config::{Sources, load};
use dalean::lab::data::{self, DataRoot};
use dalean::lab::run::{Machine, Session};
use dalean::lab::store::stream;
use dalean::task::environment::{EnvSource, Record, Replaying};
use dalean::task::policy::{PolicyExperiment, PolicyTrainer};
use libfuzzer_sys::fuzz_target;

/// What is trained: numbers in one, lines in the other.
const CONFIGS: [&str; 2] = [
    "task = \"policy\"\nenvironment = { id = \"Pendulum-v1\", count = 64, horizon = 2, steps = 128, rollouts = 1 }\n\
     network.hidden = [2]\nlearning.batch = 64\nppo.passes = 1\nevaluation = { episodes = 1, final_episodes = 1 }\n",
    "task = \"policy\"\nenvironment = { id = \"Foray-v0\", count = 64, horizon = 2, steps = 128, rollouts = 1 }\n\
     network.hidden = [2]\nlearning.batch = 64\nppo.passes = 1\nevaluation = { episodes = 1, final_episodes = 1 }\n",
];

/// What is known of one configuration.
struct Known {
    experiment: PolicyExperiment,
    /// Files of what was shown before and in the first epoch.
    streams: [Vec<u8>; 2],
    session: Session,
    checkpoint: Vec<u8>,
}

fn known(text: &str) -> Known {
    let config = load(&Sources { experiment: Some(("fuzz", text)), ..Sources::default() });
    let config = config.expect("a valid configuration");
    let experiment = config.policy_experiment().expect("it fits").expect("a policy");
    let source = EnvSource::Recorded(Arc::default());
    let trainer = PolicyTrainer::new(experiment.clone(), Backend::best(), source);
    let mut trainer = trainer.expect("it fits");
    let before = trainer.take_record().expect("recorded");
    trainer.learn(&mut |_| true).expect("an epoch is left");
    let first = trainer.take_record().expect("recorded");
    let data = data::load(&config.source().expect("an environment"), &DataRoot::new("none"));
    let machine = Machine::new(Backend::best(), 1).expect("one thread");
    let session = Session::new(&config, data.expect("no file"), machine);
    let mut session = session.expect("it fits");
    let checkpoint = session.checkpoint();
    Known { experiment, streams: [before, first].map(|one| stream::write(&one)), session, checkpoint }
}

thread_local! {
    static KNOWN: RefCell<[Known; 2]> = RefCell::new(CONFIGS.map(known));
}

/// The bytes as they are, or laid over a true file.
fn laid(bytes: &[u8], whole: &[u8], over: bool) -> Vec<u8> {
    match bytes {
        [a, b, rest @ ..] if over => {
            let mut laid = whole.to_vec();
            let at = usize::from(u16::from_le_bytes([*a, *b])) % laid.len();
            laid[at..].iter_mut().zip(rest).for_each(|(old, new)| *old = *new);
            laid
        }
        _ => bytes.to_vec(),
    }
}

/// Gives records in the place of environments: the state is reached, or an error that can be shown.
fn replay(experiment: &PolicyExperiment, records: [Record; 2]) {
    let replaying = Arc::new(Mutex::new(Replaying::default()));
    let begin = |record| replaying.lock().expect("one thread").begin(record);
    let [before, first] = records;
    begin(before);
    let source = EnvSource::Replayed(Arc::clone(&replaying));
    let mut trainer = match PolicyTrainer::new(experiment.clone(), Backend::best(), source) {
        Ok(trainer) => trainer,
        Err(error) => return assert!(!error.to_string().is_empty()),
    };
    begin(first);
    if let Err(error) = trainer.learn(&mut |_| true).and_then(|_| trainer.evaluate(1)) {
        assert!(!error.to_string().is_empty());
    }
}

fuzz_target!(|bytes: &[u8]| {
    let [mode, bytes @ ..] = bytes else { return };
    KNOWN.with_borrow_mut(|known| {
        let Known { experiment, streams, session, checkpoint } = &mut known[usize::from(mode & 1)];
        let over = mode & 2 > 0;
        if mode & 4 > 0 {
            if let Err(error) = session.restore(&laid(bytes, checkpoint, over)) {
                assert!(!error.to_string().is_empty());
            }
            session.restore(checkpoint).expect("a true checkpoint is always read");
            return;
        }
        let at = usize::from(mode >> 3 & 1);
        let mut records = streams.each_ref().map(|file| stream::read(file).expect("a true file"));
        match stream::read(&laid(bytes, &streams[at], over)) {
            Ok(record) => {
                assert_eq!(stream::read(&stream::write(&record)), Ok(record.clone()));
                records[at] = record;
                replay(experiment, records);
            }
            Err(error) => assert!(!error.is_empty()),
        }
    });
});
