//! Calls and answers of a running bench: the protocol of terminal, scripts and browser.

mod answer;
mod call;
mod chatter;
mod json;
mod status;

pub use answer::{Answer, Captured, Changed, OverlaidRun, Point, Signal};
pub use call::{Call, Quantity, TrialFile};
pub use chatter::ChatterMargin;
pub use json::schema;
pub use status::{ClockStatus, CurrentTask, Ended, LoadedStatus, Mark, MarkKind, Recorded, Status, XcpStatus};

pub use super::breakaway::BreakawayMeasurement;
pub use super::controller::{
    CornerView, DampingRay, DraftKind, HuntingView, LoopAt, LoopDraft, LoopLimits, LoopMark, LoopNumber, LoopPole,
    LoopVerdict, LoopView, PoleDrag, PoleGrip, TuneProgress,
};
pub use super::curve::{CurveName, FittedCurve, FittedParameter, MeasuredCurve, MeasuredPoint};
pub use super::fault::{FaultRecovery, FaultStatus, Look};
pub use super::form::{Choice, Item, ItemKind, PlanForm};
pub use super::frictions::LibraryFriction;
pub use super::health::Loss;
pub use super::implementation::{
    BlockSize, BuildError, BuildProgress, BuildStage, DiagramPage, Flow, FlowBlock, FlowGroup, FlowPage, FlowWire,
    LateCycle, SettingResult, Target, TargetFile, TimedPart, Timing,
};
pub use super::machine::{Factor, Machine, Part, PartKind};
pub use super::preload::AdvisedPreload;
pub use super::rendered::{KeyEstimate, Picture, RenderedFriction};
pub use super::runs::ReplayProgress;
pub use super::state::EarlierState;
pub use crate::catalogue::Records;
pub use stickslip_bench::bins::TimeBin;
pub use stickslip_bench::run::{Alignment, Course, RunEvent, Simulated, Trace};
pub use stickslip_recording::capture::Past;
pub use stickslip_study::trials::{
    Comparison, ManoeuvreForm, PairRow, RankColumn, RankRow, TrialChoices, TrialCourse, TrialPair, TrialRow,
    TrialSignal, TrialTrace, TrialValue,
};
