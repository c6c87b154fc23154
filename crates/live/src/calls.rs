//! The calls of the protocol, in the order of the services that answer them.

use std::sync::atomic::Ordering;

use stickslip_software::supervise::Request;

use super::axis::Job;
use super::protocol::{Answer, Call};
use super::{Live, LiveError, Shared, frictions, signals};
use stickslip_base::Error;
use stickslip_bench::tuning::Tuning;

impl Live {
    /// Answers a call of a client.
    ///
    /// # Errors
    /// [`LiveError::Operated`] if another client operates; [`LiveError::Busy`]
    /// if the running activity excludes the call; [`Error::Refused`] by supervision; errors of the call itself.
    pub fn call(&self, client: &str, call: Call) -> Result<Answer, Error> {
        self.shared.operation.admit(client, call.changes())?;
        self.answer(&self.shared, client, call)
    }

    /// Whether a client has ended the program.
    pub fn closed(&self) -> bool {
        self.shared.closed.load(Ordering::Relaxed)
    }

    fn close(&self) -> Result<Answer, Error> {
        let status = self.status();
        let torque = matches!(status.state.as_str(), "homing" | "running" | "stopping");
        if torque || status.doing.is_some() {
            let what = status.doing.map_or("the drive".into(), |doing| doing.what);
            return Err(LiveError::Busy { what, remedy: "Stop the axis before you end the program." }.into());
        }
        self.shared.closed.store(true, Ordering::Relaxed);
        Ok(Answer::Done {})
    }

    /// Passes a call to its service.
    fn answer(&self, shared: &Shared, client: &str, call: Call) -> Result<Answer, Error> {
        match call {
            Call::Status {} => Ok(Answer::Status(Box::new(self.status()))),
            Call::Operate {} => Ok(shared.operation.request_role(client, true)),
            Call::Ask {} => Ok(shared.operation.request_role(client, false)),
            Call::HandOver { grant } => Ok(shared.operation.hand_over(grant)),
            Call::Start {} => shared.motion.request(Request::Start),
            Call::Arm {} => shared.motion.request(Request::Arm),
            Call::Acknowledge {} => shared.motion.request(Request::Acknowledge),
            Call::Recover {} => self.recover(),
            Call::Stop {} | Call::Off {} => shared.motion.stop(matches!(call, Call::Off {})),
            Call::Close {} => self.close(),
            Call::Halt {} => Ok(shared.motion.halt()),
            Call::Home {} => self.begin("home", Job::home()),
            Call::Move { reference, values, render } => self.follow(reference, &values, render),
            Call::Jog { velocity, press, render } => self.jog(velocity, press, render),
            Call::GoTo { position, speed, render } => self.go_to(position, speed, render),
            Call::TrialChoices {} => Ok(self.trial_choices()),
            Call::Trial { motion, file, repetitions, render } => self.trial(&motion, file, repetitions, render),
            Call::Trials { limit } => {
                let (trials, of) = shared.trials.store.rows(limit);
                Ok(Answer::Trials { trials, of })
            }
            Call::TrialPair { a, b, signal, repetition, from, to, parts } => {
                let range = from.zip(to).map(|(from, to)| [from, to]);
                let pair = shared.trials.store.pair([Some(a), b], signal, repetition, range, parts);
                pair.map(|pair| Answer::TrialPair(Box::new(pair)))
            }
            Call::Compare { controllers, manoeuvres, repetitions, render } => {
                self.compare(&controllers, &manoeuvres, repetitions, render)
            }
            Call::Comparison { run } => Ok(shared.trials.comparison(run)),
            Call::Inject { fault } => self.inject(&fault),
            Call::Preload { preload } => self.preload(preload),
            Call::Measure { what, plan, render } => self.measure(what, &plan, render),
            Call::Set { values } => self.propose(|tuning| tuning.set(&values.into_iter().collect::<Vec<_>>())),
            Call::Undo {} => self.propose(Tuning::undo),
            Call::Redo {} => self.propose(Tuning::redo),
            Call::Reset {} => self.propose(Tuning::reset),
            Call::Load { name } => self.load(&name),
            Call::OpenAgain {} => self.open_again(),
            Call::Save { name } => shared.parameters.save(&name),
            Call::Sets {} => Ok(shared.parameters.names()),
            Call::PreviewSet { name } => shared.parameters.preview_set(&name),
            Call::EarlierState {} => Ok(self.earlier_state()),
            Call::RestoreState {} => self.restore_state(),
            Call::DiscardState {} => Ok(self.discard_state()),
            Call::Layout {} => shared.state.layout(),
            Call::KeepLayout { .. } if shared.operation.names().0.as_deref() != Some(client) => Ok(Answer::Done {}),
            Call::KeepLayout { layout } => shared.state.keep_layout(layout),
            Call::Parameters {} => Ok(shared.parameters.text()),
            Call::Differences {} => Ok(shared.parameters.differences()),
            Call::Items { values } => shared.parameters.items(values),
            Call::Preview { values } => shared.parameters.preview(values),
            Call::Margin { values } => shared.parameters.margin(values),
            Call::Plan { what, thorough, plan } => shared.parameters.plan(what, thorough, &plan),
            Call::Sketch(sketch) => Ok(Answer::Drawn(Box::new(sketch.draw(&shared.parameters.preset())?))),
            Call::Machine {} => Ok(shared.parameters.machine(shared.motion.preload())),
            Call::AdvisePreload { values } => self.advise_preload(values),
            Call::Loop(draft) => shared.controller.draft(&shared.parameters.tuning(), &draft),
            Call::Hunting { draft, desired } => shared.controller.hunting(&shared.parameters.tuning(), &draft, desired),
            Call::Tune(draft) => shared.controller.begin(client, &shared.parameters.tuning(), &draft),
            Call::Tuned {} => Ok(shared.controller.tuned()),
            Call::EndTuning {} => shared.controller.end(client),
            Call::Flow {} => shared.implementation.flow(&shared.parameters.tuning(), shared.links.is_virtual()),
            Call::DiagramPage { page } => shared.implementation.diagram_page(&shared.parameters.tuning(), &page),
            Call::Target {} => Ok(shared.implementation.target(shared.parameters.rate())),
            Call::Build {} => shared.implementation.build(&shared.parameters.tuning()),
            Call::Built {} => Ok(shared.implementation.built()),
            Call::EndBuild {} => Ok(shared.implementation.end_build()),
            Call::Timing {} => Ok(shared.health.timing(shared.parameters.rate())),
            Call::Losses {} => Ok(shared.health.losses(shared.parameters.rate())),
            Call::Signals {} => Ok(signals::all()),
            Call::Marks {} => Ok(shared.acquisition.marks()),
            Call::Capture { signals, trigger, before, after, decimation } => {
                shared.acquisition.captures().begin(signals, &trigger, [before, after], decimation)
            }
            Call::Fetch { capture } => shared.acquisition.captures().fetch(capture),
            Call::Stream { signals, every } => shared.acquisition.captures().watch(&signals, every),
            Call::Points { capture } => shared.acquisition.captures().points(capture),
            Call::Past { signals, from, to, points } => shared.acquisition.captures().past(&signals, from, to, points),
            Call::Samples { signals } => shared.acquisition.captures().sample(&signals),
            Call::Drop { capture } => shared.acquisition.captures().end(capture).map(|()| Answer::Done {}),
            Call::Record { name } => self.record(&name),
            Call::EndRecord {} => self.end_record(),
            Call::Curve { run } => Ok(Answer::Curve(Box::new(shared.measurements.curve(run)?))),
            Call::Frictions { breakaway } => Ok(Answer::Frictions { frictions: frictions::all(breakaway)? }),
            Call::Curves {} => Ok(Answer::Curves { curves: shared.measurements.curves() }),
            Call::AtRest { what, run } => Ok(Answer::AtRest(Box::new(shared.measurements.at_rest(what, run)?))),
            Call::Rendered { run } => Ok(Answer::Rendered(Box::new(shared.measurements.rendered(run)?))),
            Call::SaveReport {} => self.save_report(),
            Call::Runs { query, limit } => shared.runs.find(&query, limit),
            Call::Records {} => shared.runs.records(),
            Call::Run { number } => shared.runs.details(number),
            Call::Replay { number } => shared.runs.replay(number),
            Call::EndReplay {} => Ok(shared.runs.end_replay()),
            Call::Story { number } => shared.runs.story(number),
            Call::Simulate { number, values, signals, length, parts } => {
                shared.runs.simulate(number, values, &signals, length, parts)
            }
            Call::Courses { numbers, signal, align, from, to, parts } => {
                shared.runs.courses(&numbers, &signal, &align, from.zip(to), parts)
            }
            Call::RenameRun { number, name } => shared.runs.edit(|catalogue| catalogue.rename(number, &name)),
            Call::TagRun { number, add, remove } => shared.runs.edit(|catalogue| catalogue.tag(number, &add, &remove)),
            Call::NoteRun { number, note } => shared.runs.edit(|catalogue| catalogue.note(number, &note)),
            Call::DeleteRun { number } => shared.runs.edit(|catalogue| catalogue.delete(number)),
            Call::RestoreRun { number } => shared.runs.edit(|catalogue| catalogue.restore(number).map(drop)),
        }
    }
}
