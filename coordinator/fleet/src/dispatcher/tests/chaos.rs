//! Random joins, losses, answers, failures and silences: every job ends exactly once, no credit is lost, and it ends.

mod act;
mod draw;
mod fair;
mod happen;
mod world;

use act::{Act, act, late};
use world::World;

use proptest::prelude::*;
use starlings_models::{Failure, ParticleError};

use super::{RULES, crash, failed, outcomes, prediction, solver};
use crate::dispatcher::{BatchError, Event};

proptest! {
    #![proptest_config(ProptestConfig::with_cases(512))]

    #[test]
    fn every_job_ends_exactly_once_whatever_happens(
        setups in prop::collection::vec(0_u8..4, 1..40),
        local in any::<bool>(),
        acts in prop::collection::vec(act(), 0..300),
    ) {
        let mut world = World::new(&setups, local);
        for act in &acts {
            if world.ended.is_some() {
                break;
            }
            world.act(act);
        }
        if world.ended.is_none() {
            world.finish();
        }
        match world.ended.expect("finish ends it") {
            Ok(outcomes) => {
                prop_assert_eq!(outcomes.len(), setups.len());
                for (index, outcome) in outcomes.iter().enumerate() {
                    match &outcome.result {
                        Ok(result) => prop_assert_eq!(result, &prediction(index)),
                        Err(Failure::Timeout(timeout)) => prop_assert_eq!(timeout, &late()),
                        Err(Failure::Model(error)) => {
                            prop_assert!(*error == failed("no") || *error == failed("crash"));
                        }
                    }
                    prop_assert!(outcome.attempts >= 1 && outcome.attempts <= RULES.max_attempts + 2);
                }
            }
            Err(BatchError::NoWorkers { waited, .. }) => prop_assert!(waited >= RULES.patience),
            Err(BatchError::SetupFailed { .. } | BatchError::NoControl { .. } | BatchError::NoAnswer { .. }) => {}
            Err(BatchError::Unavailable { waited, .. }) => prop_assert!(waited >= RULES.patience),
            Err(error) => prop_assert!(false, "unexpected end: {error:?}"),
        }
        prop_assert!(outcomes(&world.dispatcher.step(world.now, Event::Tick)).is_none());
    }

    /// The same where results are compared: workers that fail now and then are put out, jobs are made again, and it ends all the same.
    #[test]
    fn every_job_ends_exactly_once_where_results_are_compared(
        setups in prop::collection::vec(0_u8..4, 1..40),
        local in any::<bool>(),
        acts in prop::collection::vec(act(), 0..300),
    ) {
        let mut world = World::comparing(&setups, local);
        for act in &acts {
            if world.ended.is_some() {
                break;
            }
            world.act(act);
        }
        if world.ended.is_none() {
            world.finish();
        }
        if let Ok(outcomes) = world.ended.expect("finish ends it") {
            prop_assert_eq!(outcomes.len(), setups.len());
            for (index, outcome) in outcomes.iter().enumerate() {
                prop_assert!(outcome.result.as_ref().map_or(true, |result| *result == prediction(index)));
            }
        }
    }

    /// What a run of a job gives depends on the job alone; places fail now and then, workers leave and come.
    #[test]
    fn infrastructure_never_changes_an_outcome(
        natures in prop::collection::vec(0_u8..8, 1..30),
        acts in prop::collection::vec(act(), 0..400),
    ) {
        let setups = vec![0; natures.len()];
        // The first one works: without any, nobody can tell.
        let ends = |index: usize| match natures[index] {
            0 if index > 0 => Err(solver("no")),
            1 if index > 0 => Err(crash("crash")),
            2 if index > 0 => Err(late().into()),
            _ => Ok(prediction(index)),
        };
        let mut world = World::new(&setups, false);
        world.join(2);
        world.act(&Act::BuildSetup(0, true));
        let mut acts = acts.iter();
        for _ in 0..2000 {
            if world.ended.is_some() {
                break;
            }
            match acts.next() {
                Some(Act::Answer(which, _) | Act::Fail(which) | Act::Crash(which) | Act::Late(which)) => {
                    world.truly(*which, ends);
                }
                // It leaves without counting an attempt.
                Some(Act::Lose(which, _)) => world.act(&Act::Lose(*which, true)),
                Some(Act::BuildSetup(which, _)) => world.act(&Act::BuildSetup(*which, true)),
                Some(act @ (Act::Place(_) | Act::Join(_) | Act::Repeat(_) | Act::Reconnect(_))) => world.act(act),
                Some(_) => {}
                None => {
                    world.join(2);
                    world.act(&Act::BuildSetup(usize::MAX, true));
                    world.act(&Act::BuildSetup(0, true));
                    (0..8).for_each(|_| world.truly(0, ends));
                }
            }
        }
        let outcomes = world.ended.expect("it ends").expect("good workers came");
        for (index, outcome) in outcomes.iter().enumerate() {
            let wanted = match ends(index) {
                Ok(prediction) => Ok(prediction),
                Err(ParticleError::Timeout(timeout)) => Err(timeout.into()),
                Err(ParticleError::Model(error)) => Err(error.into()),
                Err(_) => Err(failed("crash").into()),
            };
            prop_assert_eq!(&outcome.result, &wanted);
        }
    }
}
