// Generated from the schema of the protocol; do not edit. See crates/app/tests/protocol.rs.
/** A call. In JSON an object with the key `call`: `{"call": "set", "values": {"bench.law.kind": "bristle"}}`. */
export type Call = {
  call: "status"
}
  | {
  call: "home"
}
  | {
  call: "start"
}
  | {
  call: "arm"
}
  | {
  call: "stop"
}
  | {
  call: "off"
}
  | {
  call: "close"
}
  | {
  call: "acknowledge"
}
  | {
  call: "recover"
}
  | {
  call: "halt"
}
  | {
  call: "move"
  /** Kind of reference: `sine`, `steps`, `point-to-point`, … */
  reference: string
  /** Whether the load motor renders the desired friction during the motion. */
  render?: boolean
  /** Its values by name, SI units; default: those of the reference. */
  values?: Record<string, number>
}
  | {
  call: "jog"
  /** Number of the press of the button, another one for each press. */
  press: number
  /** Whether the load motor renders the desired friction during the motion. */
  render?: boolean
  /** Velocity of the screw [rad/s]; 0 releases the button. */
  velocity: number
}
  | {
  call: "go_to"
  /** Angle of the screw from its zero [rad]. */
  position: number
  /** Whether the load motor renders the desired friction during the motion. */
  render?: boolean
  /** Largest speed [rad/s]; default: a fifth of the limit of the axis. */
  speed?: number | null
}
  | {
  call: "trial_choices"
}
  | {
  call: "trial"
  /** Positions over time instead of a manoeuvre. */
  file?: TrialFile
    | null
  /** A manoeuvre of `trial_choices`; ignored with a file. */
  motion?: string
  /** Whether the load motor renders the desired friction. */
  render?: boolean
  /** Number of repetitions, 1 to 20. */
  repetitions?: number
}
  | {
  call: "trials"
  /** Maximum number of listed trials. */
  limit?: number
}
  | {
  /** Number of trial A. */
  a: number
  /** Number of trial B. */
  b?: number | null
  call: "trial_pair"
  /** Start of the shown range [s]. */
  from?: number | null
  /** Number of intervals of a curve; at most 4000. */
  parts: number
  /** The repetition, from 1. */
  repetition?: number
  /** The signal. */
  signal?: TrialSignal
  /** End of the shown range [s]. */
  to?: number | null
}
  | {
  call: "compare"
  /** `active`, or controllers of `trial_choices`; at least two. The first is the reference. */
  controllers: string[]
  /** Manoeuvres of `trial_choices`. */
  manoeuvres: string[]
  /** Whether the load motor renders the desired friction. */
  render?: boolean
  /** Number of repetitions, 2 to 20. */
  repetitions: number
}
  | {
  call: "comparison"
  /** Number of its run; default: the running or last one. */
  run?: number | null
}
  | {
  call: "inject"
  /** Name and value of the fault: `encoder-stuck`, `counts-lost=0.02`. */
  fault: string
}
  | {
  call: "preload"
  /** Preload, 0 (released) … 1. */
  preload: number
}
  | {
  call: "measure"
  /** Values of its plan, as in a file. */
  plan?: Record<string, string>
  /** Measure the friction while the load motor renders the desired one. */
  render?: boolean
  /** The measured quantity. */
  what: Quantity
}
  | {
  call: "set"
  /** Value by path. */
  values: Record<string, string>
}
  | {
  call: "undo"
}
  | {
  call: "redo"
}
  | {
  call: "reset"
}
  | {
  call: "open_again"
}
  | {
  call: "save"
  /** Letters, digits, `-` and `_`. */
  name: string
}
  | {
  call: "load"
  /** Its name. */
  name: string
}
  | {
  call: "sets"
}
  | {
  call: "preview_set"
  /** Its name. */
  name: string
}
  | {
  call: "earlier_state"
}
  | {
  call: "restore_state"
}
  | {
  call: "discard_state"
}
  | {
  call: "keep_layout"
  /** The layout, at most 64 kB. */
  layout: string
}
  | {
  call: "layout"
}
  | {
  call: "parameters"
}
  | {
  call: "differences"
}
  | {
  call: "items"
  /** Value by path, as in `set`. */
  values?: Record<string, string>
}
  | {
  call: "preview"
  /** Value by path, as in `set`. */
  values: Record<string, string>
}
  | {
  call: "machine"
}
  | {
  call: "flow"
}
  | {
  call: "diagram_page"
  /** Its file, as listed by `flow`. */
  page: string
}
  | {
  call: "timing"
}
  | {
  call: "target"
}
  | {
  call: "build"
}
  | {
  call: "built"
}
  | {
  call: "end_build"
}
  | {
  call: "plan"
  /** Values that differ from this plan. */
  plan?: Record<string, string>
  /** The thorough plan instead of the default. */
  thorough?: boolean
  /** The measured quantity. */
  what: Quantity
}
  | {
  call: "curve"
  /** Number of its run; default: the running or last measurement. */
  run?: number | null
}
  | {
  call: "curves"
}
  | {
  /** Scales their torques to this breakaway torque [N m]; default: as identified. */
  breakaway?: number | null
  call: "frictions"
}
  | {
  call: "rendered"
  /** Number of its run; default: the running or last measurement. */
  run?: number | null
}
  | {
  call: "at_rest"
  /** Number of its run; default: the running or last measurement. */
  run?: number | null
  /** The measured quantity. */
  what: Quantity
}
  | {
  call: "advise_preload"
  /** Value by path, as in `set`. */
  values?: Record<string, string>
}
  | {
  call: "losses"
}
  | {
  call: "save_report"
}
  | {
  /** Bristles: stiffness [N m/rad], damping [N m s/rad], elastic limit as a share; default: the active ones. */
  bristles?: [number, number, number] | null
  call: "sketch"
  /** Breakaway torque [N m], kinetic torque [N m], Stribeck velocity [rad/s], viscous friction [N m s/rad]; default: the active ones. */
  desired?: [number, number, number, number] | null
  /** The dragged handle. */
  drag?: Drag
    | null
  /** Whether the curve is fitted to the points. */
  fit?: boolean
  /** Whether the curve is moved to the nearest renderable one. */
  nearest?: boolean
  /** Reference points. */
  points?: Reference[]
  /** Speeds at which the curve is evaluated, at least 0 [rad/s]. */
  speeds: number[]
  /** Whether to compute remedies for a curve that cannot be rendered; takes a hundred times longer. */
  thorough?: boolean
}
  | {
  call: "margin"
  /** Value by path, as in `set`. */
  values?: Record<string, string>
}
  | {
  call: "loop"
  /** Dragged position of the pair of poles; a controller without specified poles becomes a state feedback with them. */
  drag?: PoleDrag
    | null
  /** Converts the controller to this kind, or uses the defaults of this kind. */
  kind?: DraftKind
    | null
  /** Largest overshoot of a set-point step, as a share: lowers the set-point weight; a cascade becomes a PID controller. */
  overshoot?: number | null
  /** Speed at which the load slides [rad/s]; default: 10. */
  speed?: number | null
  /** Whether the corners of the machine's uncertainty are checked as well; takes several times as long. */
  thorough?: boolean
  /** Values that differ from the active ones, by path, as in `set`. */
  values?: Record<string, string>
}
  | {
  call: "hunting"
  /** Use the desired friction, which the load motor renders, instead of the machine's own. */
  desired?: boolean
  /** The draft. */
  draft?: LoopDraft
}
  | {
  call: "tune"
  /** Dragged position of the pair of poles; a controller without specified poles becomes a state feedback with them. */
  drag?: PoleDrag
    | null
  /** Converts the controller to this kind, or uses the defaults of this kind. */
  kind?: DraftKind
    | null
  /** Largest overshoot of a set-point step, as a share: lowers the set-point weight; a cascade becomes a PID controller. */
  overshoot?: number | null
  /** Speed at which the load slides [rad/s]; default: 10. */
  speed?: number | null
  /** Whether the corners of the machine's uncertainty are checked as well; takes several times as long. */
  thorough?: boolean
  /** Values that differ from the active ones, by path, as in `set`. */
  values?: Record<string, string>
}
  | {
  call: "tuned"
}
  | {
  call: "end_tuning"
}
  | {
  call: "signals"
}
  | {
  /** Time after the trigger [s]. */
  after: number
  /** Time before the trigger [s]. */
  before: number
  call: "capture"
  /** Decimation: every n-th tick is kept, at least 1. */
  decimation?: number
  /** Names of the signals. */
  signals: string[]
  /** Trigger condition: `immediate`, `setpoint.velocity rises through 0.1`, … */
  trigger: string
}
  | {
  call: "fetch"
  /** Its number. */
  capture: number
}
  | {
  call: "stream"
  /** Time from point to point [s], at least one tick. */
  every: number
  /** Names of the signals. */
  signals: string[]
}
  | {
  call: "points"
  /** The stream's number. */
  capture: number
}
  | {
  call: "past"
  /** The first cycle. */
  from: number
  /** Largest number of blocks; at most 4096. */
  points: number
  /** Names of the signals. */
  signals: string[]
  /** The cycle after the last one. */
  to: number
}
  | {
  call: "samples"
  /** Names of the signals, each once. */
  signals: string[]
}
  | {
  call: "marks"
}
  | {
  call: "drop"
  /** Its number. */
  capture: number
}
  | {
  call: "operate"
}
  | {
  call: "record"
  /** Letters, digits, `-` and `_`. */
  name: string
}
  | {
  call: "end_record"
}
  | {
  call: "runs"
  /** Maximum number of listed runs. */
  limit?: number
  /** Words, `law:bristle`, `M_S>0.2`, `-tag:bad`; empty for all. */
  query?: string
}
  | {
  call: "records"
}
  | {
  call: "run"
  /** Its number. */
  number: number
}
  | {
  call: "replay"
  /** Its number. */
  number: number
}
  | {
  call: "end_replay"
}
  | {
  call: "simulate"
  /** Simulated time from the start of the run [s]; at most 120. */
  length: number
  /** Its number. */
  number: number
  /** Number of points in a trace; at most 4000. */
  parts: number
  /** Names of the signals to return. */
  signals: string[]
  /** Value by path, as in `set`; also parameters of the machine. */
  values?: Record<string, string>
}
  | {
  /** Alignment of their times. */
  align: Alignment
  call: "courses"
  /** Start of the shown range, in aligned time [s]. */
  from?: number | null
  /** Their numbers; at most six. */
  numbers: number[]
  /** Number of points in a course; at most 4000. */
  parts: number
  /** Name of the signal. */
  signal: string
  /** End of the shown range [s]. */
  to?: number | null
}
  | {
  call: "story"
  /** Its number. */
  number: number
}
  | {
  call: "rename_run"
  /** The new name. */
  name: string
  /** Its number. */
  number: number
}
  | {
  /** Tags to add. */
  add?: string[]
  call: "tag_run"
  /** Its number. */
  number: number
  /** Tags to remove. */
  remove?: string[]
}
  | {
  call: "note_run"
  /** The note; empty: removed. */
  note: string
  /** Its number. */
  number: number
}
  | {
  call: "delete_run"
  /** Its number. */
  number: number
}
  | {
  call: "restore_run"
  /** Its number. */
  number: number
}
  | {
  call: "ask"
}
  | {
  call: "hand_over"
  /** Whether the request is granted. */
  grant: boolean
}
/** An answer. In JSON an object with the key `answer`. */
export type Answer = {
  answer: "done"
}
  | Status & {
  answer: "status"
}
  | {
  answer: "entered"
  /** First cycle with the new values. */
  cycle: number
  /** The changed values. */
  differences: Changed[]
  /** Margin of the rendering law against chatter, in words; `null` if the law did not change. */
  margin: string | null
}
  | {
  answer: "differences"
  /** The differing values. */
  differences: Changed[]
}
  | {
  answer: "items"
  /** In the order of declaration. */
  items: Item[]
}
  | Machine & {
  answer: "machine"
}
  | Flow & {
  answer: "flow"
}
  | DiagramPage & {
  answer: "diagram_page"
}
  | Timing & {
  answer: "timing"
}
  | Target & {
  answer: "target"
}
  | BuildProgress & {
  answer: "built"
}
  | PlanForm & {
  answer: "plan"
}
  | MeasuredCurve & {
  answer: "curve"
}
  | {
  answer: "curves"
  /** The newest first. */
  curves: CurveName[]
}
  | {
  answer: "frictions"
  /** Frictions identified on physical machines. */
  frictions: LibraryFriction[]
}
  | RenderedFriction & {
  answer: "rendered"
}
  | BreakawayMeasurement & {
  answer: "at_rest"
}
  | TrialChoices & {
  answer: "trial_choices"
}
  | {
  answer: "trials"
  /** Number of all trials. */
  of: number
  /** The newest first. */
  trials: TrialRow[]
}
  | TrialPair & {
  answer: "trial_pair"
}
  | Comparison & {
  answer: "comparison"
}
  | AdvisedPreload & {
  answer: "advised_preload"
}
  | {
  answer: "losses"
  /** Missed cycles: a deadline was missed, or the virtual machine waited for a command; the newest last. */
  held: Loss[]
  /** Cycles that recorders and viewers did not receive, the newest last. */
  lost: Loss[]
}
  | {
  answer: "report"
  /** Its folder. */
  folder: string
  /** Its number: the page is at `/report/NUMBER`. */
  run: number
}
  | Drawn & {
  answer: "drawn"
}
  | ChatterMargin & {
  answer: "margin"
}
  | LoopView & {
  answer: "loop"
}
  | HuntingView & {
  answer: "hunting"
}
  | TuneProgress & {
  answer: "tuned"
}
  | {
  answer: "text"
  /** The text. */
  text: string
}
  | {
  answer: "names"
  /** Sorted. */
  names: string[]
}
  | {
  answer: "signals"
  /** Signals that the scope shows first, one list for each pane. */
  panes: string[][]
  /** In the order of a row. */
  signals: Signal[]
}
  | {
  answer: "capture"
  /** Its number. */
  capture: number
  /** `filling`, `armed`, `delayed`, `triggered`; of a stream `streaming`. */
  stage: string
}
  | Captured & {
  answer: "captured"
}
  | {
  answer: "points"
  /** The points. */
  points: Point[]
}
  | Past & {
  answer: "past"
}
  | {
  answer: "samples"
  /** Its number. */
  capture: number
}
  | {
  answer: "marks"
  /** The newest last. */
  marks: Mark[]
}
  | EarlierState & {
  answer: "earlier_state"
}
  | Records & {
  answer: "records"
}
  | {
  answer: "runs"
  /** Terms of the query that were ignored, and damaged entries. */
  hints: string[]
  /** Number of all runs that match the query. */
  of: number
  /** The newest first. */
  runs: Run[]
}
  | {
  answer: "run"
  /** File formats to which its record can be exported: `/run/NUMBER/run.mf4?as=parquet`. */
  leaves_as: string[]
  /** As in a list. */
  run: Run
  /** Its parameters and results. */
  values: Value[]
}
  | ReplayProgress & {
  answer: "replay"
}
  | {
  answer: "simulated"
  /** The changed parameters. */
  differences: Changed[]
  /** The traces. */
  simulated: Simulated
}
  | {
  answer: "courses"
  /** In the order of the request. */
  courses: OverlaidRun[]
}
  | {
  answer: "story"
  /** In order of time. */
  happened: RunEvent[]
}
/** Advice on the preload of the friction wheel. */
export type AdvisedPreload = {
  /** Whether the preload must be set by hand. */
  by_hand: boolean
  /** Whether the desired friction requires another preload than the present one. */
  needed: boolean
  /** The required preload, 0 … 1; `null` if unknown, or if any is suitable. */
  preload: number | null
  /** Reason and action. */
  sentence: string
}
/** Alignment of several courses. */
export type Alignment = {
  by: "begin"
}
  | {
  by: "rise"
  /** Level in the unit of the signal. */
  level: number
}
  | {
  by: "correlation"
}
  | {
  by: "hand"
  /** Offset added to the time of each [s]. */
  shifts: number[]
}
/** Quantity, unit and scale of an axis. */
export type Axis = {
  /** ln x instead of x. */
  logarithmic?: boolean
  /** The quantity. */
  quantity: string
  /** Fixed range instead of that of the data. */
  range?: [number, number] | null
  /** asinh(x/2) instead of x. */
  stretched: boolean
  /** Unit, as in a field. */
  unit: string
}
/** Size of a block, with all called blocks. */
export type BlockSize = {
  /** Number of lines of C. */
  lines: number
  /** Number of operations in a step. */
  operations: number
  /** Number of parameters. */
  parameters: number
  /** Number of state variables. */
  states: number
}
/** A measurement of breakaway or presliding, complete or running. */
export type BreakawayMeasurement = {
  /** Figures: that of the measurement first, then comparisons with earlier runs. */
  figures: Picture[]
  /** The results. */
  keys: KeyEstimate[]
  /** Whether the measurement is running. */
  measuring: boolean
  /** Warnings, each with a remedy. */
  notes: string[]
  /** Values to adopt it as own friction, by path, as for `set`. */
  own: Record<string, string>
  /** Number of the run; `null` during the measurement and if there is none. */
  run: number | null
  /** Runs of the same measurement, the newest first. */
  runs: number[]
}
/** An error of the compiler. */
export type BuildError = {
  /** Name of the block. */
  block: string
  /** Diagram page of the block; `null` if the line belongs to no block. */
  page: string | null
  /** File and line. */
  place: string
  /** Message of the compiler. */
  text: string
}
/** Progress or result of a build. */
export type BuildProgress = {
  /** Errors of the compiler. */
  errors: BuildError[]
  /** Folder of the files. */
  folder: string
  /** Commands and their output. */
  log: string
  /** Duration of compilation and test [s]. */
  seconds: [number, number] | null
  /** The result in a sentence. */
  sentence: string
  /** Size of the object: code and constants, data, zeroed data [bytes]; `null` if unknown. */
  sizes: [number, number, number] | null
  /** The current stage. */
  stage: BuildStage
}
/** Stage of a build. */
export type BuildStage = "never"
  | "compiling"
  | "testing"
  | "passed"
  | "failed"
  | "no_compiler"
  | "cancelled"
/** A complete capture. */
export type Captured = {
  /** Values of each signal in each row; `null` if not finite. */
  columns: ((number | null)[])[]
  /** Number of the cycle of each row. */
  cycles: number[]
  /** Lost cycles. */
  lost: number
  /** Requested ticks before the trigger that were not yet available. */
  missing: number
  /** Names of the columns. */
  signals: string[]
  /** Time of each row, 0 at the trigger [s]. */
  times: number[]
  /** Index of the trigger's row. */
  trigger: number
}
/** A changed value. */
export type Changed = {
  /** Value after, with its unit. */
  after: string | null
  /** Value before, with its unit. */
  before: string | null
  /** Its dotted path. */
  path: string
}
/** Margin of a rendering law against chatter. */
export type ChatterMargin = {
  /** Remaining share below which a warning is shown. */
  caution: number
  /** Predicted change of the load torque within a millisecond [N m RMS]. */
  chatter: number
  /** Limit of this change; above it the law chatters [N m RMS]. */
  chatter_limit: number
  /** Additional delay up to which the loop is stable [s]; `null`: stable for all tried delays. */
  delay_margin: number | null
  /** Factor of the law's torque up to which the loop is stable; `null`: stable for all tried factors. */
  gain_margin: number | null
  /** Remaining share of the distance to the nearest limit, 0 … 1; `null` if unknown. */
  left: number | null
  /** The nearest limit: `chatter`, `stiffness`. */
  nearest: string
  /** The result in a sentence; if unstable, with the cause and a remedy. */
  sentence: string
  /** Whether the loop is stable: the bench accepts the law. */
  stable: boolean
  /** Stiffness of the desired bristles [N m/rad]; `null` for a law without bristles. */
  stiffness: number | null
  /** Largest stiffness of the desired bristles without chatter [N m/rad]; `null`: no limit found, or not stable. */
  stiffness_limit: number | null
}
/** An option of a choice. */
export type Choice = {
  /** Description. */
  help: string
  /** Name in files. */
  name: string
}
/** Timing of the real-time loop. Times in seconds. */
export type ClockStatus = {
  /** Duration of a cycle, likewise. */
  cycle: [number, number, number, number]
  /** Missed cycles: a deadline was missed, or the virtual machine waited for a command. */
  held: number
  /** From the deadline to the start of a cycle: median, 99th and 99.9th percentile, longest. */
  lateness: [number, number, number, number]
  /** Median duration of a cycle as a share of the tick. */
  load: number
  /** Cycles lost on the way to recorders and viewers: their buffer was full. */
  lost: number
}
/** A comparison of controllers. */
export type Comparison = {
  /** The measures, in the order of the values of a row. */
  columns: RankColumn[]
  /** Whether all controllers have completed all manoeuvres. */
  complete: boolean
  /** The friction. */
  friction: string
  /** Results and notes, in sentences. */
  remarks: string[]
  /** Number of repetitions. */
  repetitions: number
  /** The controllers, the best first. */
  rows: RankRow[]
  /** Number of its run; 0: none yet. */
  run: number
  /** Whether it is running. */
  running: boolean
}
/** A corner: a machine that deviates from the model by these factors. */
export type CornerView = {
  /** Factor of the coupling stiffness. */
  coupling_stiffness: number
  /** `sliding` or `stuck`. */
  load: string
  /** Factor of the load inertia. */
  load_inertia: number
  /** Peak of the sensitivity; `null` if the loop is not stable. */
  sensitivity: number | null
}
/** Values of the counters. */
export type Counts = {
  /** Ticks with readings in time. */
  answered: number
  /** Number of starts of the machine. */
  begun: number
  /** Answers that arrived twice. */
  doubled: number
  /** Unreadable frames, on either side. */
  garbled: number
  /** Answers that arrived after their tick. */
  late: number
  /** Ticks without readings in time. */
  missing: number
}
/** Course of a signal of a run, with minimum and maximum in each part of the time, so that no spike is lost. */
export type Course = {
  /** Time of the first row of the record [s]. */
  begin: number
  /** Time of the last row [s]. */
  end: number
  /** Middle of each part of the time [s]. */
  time: number[]
  /** SI unit. */
  unit: string
  /** Minimum and maximum in each part; `null` for lost rows. */
  values: [(number | null)[], (number | null)[]]
}
/** A running motion or measurement. */
export type CurrentTask = {
  /** Completed share of the stage, 0 … 1. */
  fraction: number
  /** The current stage. */
  stage: string
  /** Its name: `sine`, `measure friction`. */
  what: string
}
/** A run with a friction curve. */
export type CurveName = {
  /** Name of its folder. */
  name: string
  /** Whether the load motor rendered the desired friction. */
  rendered: boolean
  /** Its number. */
  run: number
}
/** Direction of the poles of a damping ratio. */
export type DampingRay = {
  /** The damping ratio. */
  damping: number
  /** Imaginary part of the unit vector; the other ray has the opposite sign. */
  imaginary: number
  /** Real part of the unit vector. */
  real: number
}
/** Pairs x, y; x, y and half width; or x with the lower and the upper edge, in the units of the axes. */
export type Data = {
  kind: "points"
  values: ([number | null, number | null])[]
}
  | {
  kind: "bars"
  values: ([number | null, number | null, number | null])[]
}
  | {
  kind: "line"
  values: ([number | null, number | null])[]
}
  | {
  kind: "band"
  values: ([number | null, number | null, number | null])[]
}
/** State of a device. */
export type DeviceStatus = {
  /** AL state: `OP`, `SAFE-OP`, `PRE-OP`, `INIT`, `no answer`. */
  al_state: string
  /** State of a drive. */
  drive: DriveStatus
    | null
  /** Its fault: error code and AL status code, with their meaning. */
  fault: string | null
  /** Name. */
  name: string
  /** Position in the segment, from 0. */
  position: number
  /** Role in the bench: `motor`, `load`, `accelerometer`; otherwise empty. */
  role: string
}
/** A page of the generated signal-flow diagram. */
export type DiagramPage = {
  /** The functions in C; called functions come first. */
  code: string
  /** Name of the shown block. */
  name: string
  /** Its file, as in links between pages. */
  page: string
  /** Size of the block. */
  size: BlockSize
  /** The picture; its boxes link to pages. */
  svg: string
}
/** Kind of controller of a draft. */
export type DraftKind = "cascade"
  | "pid"
  | "state-feedback"
  | "predictive"
/** A dragged handle. */
export type Drag = {
  /** The handle. */
  handle: Handle
  /** Whether the other parameters are fitted to the reference points. */
  refit?: boolean
  /** Speed at the pointer [rad/s]. */
  speed: number
  /** Torque at the pointer [N m]. */
  torque: number
}
/** The computed view of a sketch. */
export type Drawn = {
  /** Desired friction at each speed [N m]. */
  curve: number[]
  /** As [`Sketch::desired`](super::Sketch::desired). */
  desired: [number, number, number, number]
  /** The presliding loop of the desired friction. */
  desired_loop: Loop
  /** RMS distance from the reference points [N m]; `null` without any. */
  distance: number | null
  /** Limits of the smallest and the largest friction. */
  edges: Edge[]
  /** Handles of the single parameters. */
  grips: Grip[]
  /** Largest friction that can be rendered steadily at each speed [N m]. */
  largest: number[]
  /** Smallest friction that can be rendered steadily at each speed [N m]. */
  least: number[]
  /** Factor of the difference torque at which a limit is reached; `null`: unlimited. */
  margin: number | null
  /** The nearest of the limits; `null` if nothing is required. */
  nearest: NearestLimit
    | null
  /** Own friction at each speed [N m]. */
  own: number[]
  /** The presliding loop of the own friction, over the same way. */
  own_loop: Loop
  /** Remarks, in sentences. */
  remarks: string[]
  /** Whether it can be rendered. */
  renderable: boolean
  /** Speed ranges in which it cannot be rendered. */
  shortages: SpeedRange[]
  /** Indices of the reference points that contradict the others and are not used. */
  strays: number[]
}
/** State of a drive after CiA 402. */
export type DriveStatus = {
  /** Error code (0x603F); 0: none. */
  error: number
  /** State in words: `operation enabled`. */
  state: string
  /** Statusword (0x6041). */
  statusword: number
}
/** State of the target before the start of the program. */
export type EarlierState = {
  /** Values that would change: on the target now, and in the earlier state. */
  differences: Changed[]
  /** Why it cannot be restored; `null` if it can. */
  refused: string | null
  /** Time of its last change, RFC 3339, UTC; `null` if there is none. */
  saved: string | null
}
/** A part of an edge of the renderable region. */
export type Edge = {
  /** Lower end [rad/s]. */
  from: number
  /** Whether it is the edge of the largest friction, not of the smallest. */
  largest: boolean
  /** `drive`, `current`, `voltage`; `wheel` where the law renders no torque and the friction wheel alone acts. */
  limit: string
  /** Upper end [rad/s]. */
  to: number
}
/** End of a motion or measurement. */
export type Ended = {
  /** Reason, if it failed or was cancelled. */
  error: string | null
  /** Folder of its results. */
  folder: string | null
  /** Its name: `sine`, `measure friction`. */
  what: string
}
/** A unit of display. */
export type Factor = {
  /** Factor from the SI unit. */
  factor: number
  /** Unit as printed. */
  unit: string
}
/** The way back after a fault. */
export type FaultRecovery = "acknowledge"
  | "arm"
  | "home"
  | "reopen"
/** A fault with its remedy. */
export type FaultStatus = {
  /** Number of the run with the signals around it; `null` until it is saved. */
  capture: number | null
  /** The cause, with the measured values. */
  cause: string
  /** Name of its kind: `following-error`. */
  code: string
  /** The first cycle with it. */
  cycle: number
  /** Where to change what the remedy names; `null` if it is not a setting. */
  look: Look
    | null
  /** The way back, as the call `recover` takes it. */
  recovery: FaultRecovery
  /** What to check or to change. */
  remedy: string
}
/** A plot. Points are drawn first, then bands, then lines, so that no cloud hides a curve. */
export type Figure = {
  /** Named parts of the horizontal axis. */
  intervals?: Interval[]
  /** The series. */
  series: Series[]
  /** The title. */
  title: string
  /** To the right. */
  x: Axis
  /** Upwards. */
  y: Axis
}
/** A Stribeck curve through measured points. */
export type FittedCurve = {
  /** Half the width of its 95 % band [N m]. */
  band: (number | null)[]
  /** Parameters that the data do not determine, and the measurements that would. */
  findings: string[]
  /** RMS of the residuals as a share of the breakaway torque; `null` if that is 0. */
  misfit: number | null
  /** Values to adopt it as own friction, by path, as for `set`; empty if a parameter is unknown. */
  own: Record<string, string>
  /** Its parameters. */
  parameters: FittedParameter[]
  /** RMS of the residuals [N m]. */
  rms: number
  /** Torques of the line [N m]. */
  torque: (number | null)[]
  /** Velocities of the line, rising; `null` is the gap at standstill [rad/s]. */
  velocity: (number | null)[]
}
/** A parameter of a fit. */
export type FittedParameter = {
  /** Half the width of its 95 % interval as printed, without the sign. */
  half_width: string
  /** Key in files. */
  key: string
  /** Whether the data determine it. */
  known: boolean
  /** Name. */
  name: string
  /** Symbol in equations. */
  symbol: string
  /** The unit of both, with its prefix. */
  unit: string
  /** Value as printed; `unknown` if the data do not determine it. */
  value: string
}
/** Signal-flow diagram of the running software. Positions in units of the picture, from its upper left corner. */
export type Flow = {
  /** The blocks, in the order of the signal flow. */
  blocks: FlowBlock[]
  /** All pages of the generated diagram, the overview first. */
  pages: FlowPage[]
  /** Width and height. */
  size: [number, number]
  /** The wires between the blocks. */
  wires: FlowWire[]
}
/** A block. */
export type FlowBlock = {
  /** Function of the block. */
  about: string
  /** Left, upper edge, width, height. */
  at: [number, number, number, number]
  /** Paths of parameters that differ from those at the start of the run. */
  changed: string[]
  /** The chosen kind; empty if there is no choice. */
  choice: string
  /** Groups of its parameters. */
  groups: FlowGroup[]
  /** Page of the guide. */
  guide: string | null
  /** Identifier. */
  id: string
  /** Name. */
  name: string
  /** Diagram page of its interior. */
  page: string | null
}
/** A group of parameters. */
export type FlowGroup = {
  /** Why they cannot be changed on a running bench, with a remedy. */
  fixed: string | null
  /** Common prefix of their paths. */
  path: string
}
/** A page of the generated diagram. */
export type FlowPage = {
  /** Name of the shown block. */
  name: string
  /** Its file, as in links between pages. */
  page: string
}
/** A wire. */
export type FlowWire = {
  /** The block that it leaves. */
  from: string
  /** Position of the value; `null` on a branch of a wire that shows it already. */
  label: [number, number] | null
  /** Its corners; the arrow is at the last. */
  points: [number, number][]
  /** The signal that it carries. */
  signal: string
  /** The block that it enters. */
  to: string
}
/** Places of frames in the cycle of SYNC0; positive: after the middle between two pulses. */
export type FrameOffset = {
  /** Largest. */
  maximum: number
  /** Smallest. */
  minimum: number
  /** Root of the mean square. */
  rms: number
}
/** A handle on the curve. */
export type Grip = {
  /** The handle. */
  handle: Handle
  /** Smallest and largest value. */
  range: [number, number]
  /** Its speed in the figure [rad/s]. */
  speed: number
  /** Symbol. */
  symbol: string
  /** Its torque in the figure [N m]. */
  torque: number
  /** SI unit. */
  unit: string
  /** Its value. */
  value: number
}
/** Handles of a curve. */
export type Handle = "breakaway_torque"
  | "kinetic_torque"
  | "stribeck_velocity"
  | "viscous_friction"
  | "line"
/** Prediction of hunting at a constant set-point: the numbers of `stickslip hunting`. */
export type HuntingView = {
  /** Half the distance between the extremes [rad]; `null` without hunting. */
  amplitude: number | null
  /** The amplitude in encoder counts. */
  counts: number | null
  /** Whether it uses the desired friction, which the load motor renders, instead of the machine's own. */
  desired: boolean
  /** Deviations from the set-point [mrad]. */
  deviation: number[]
  /** Whether hunting is predicted. */
  hunts: boolean
  /** Time from one slip to the next [s]. */
  interval: number | null
  /** The prediction in a sentence. */
  sentence: string
  /** Instants [s]. */
  time: number[]
}
/** A named part of the horizontal axis. */
export type Interval = {
  /** Its start. */
  from: number
  /** Its name. */
  name: string
  /** Its end. */
  to: number
}
/** A parameter with its description. */
export type Item = {
  /** The chosen option; `null` for a number. */
  choice: string | null
  /** Default value. */
  default: number | null
  /** Description. */
  help: string
  /** Kind of value. */
  kind: ItemKind
  /** Largest value; `null`: unlimited. */
  maximum: number | null
  /** Smallest value; `null`: unlimited. */
  minimum: number | null
  /** The options of a choice. */
  options: Choice[]
  /** Its dotted path. */
  path: string
  /** Symbol in equations; may be empty. */
  symbol: string
  /** SI unit as printed; empty for a pure number and for a choice. */
  unit: string
  /** The number; `null` for a choice. A flag is 0 or 1. */
  value: number | null
}
/** Kind of value. */
export type ItemKind = "real"
  | "whole"
  | "flag"
  | "choice"
/** A number with its uncertainty, as printed. */
export type KeyEstimate = {
  /** Half the width of its 95 % interval, without the sign; empty if there is none. */
  half_width: string
  /** Name. */
  name: string
  /** The unit of both, with its prefix. */
  unit: string
  /** The value, or `unknown`. */
  value: string
}
/** A number with its name. */
export type KeyNumber = {
  /** Name in the summary. */
  name: string
  /** Its unit; `1` for a pure number. */
  unit: string
  /** Value in SI units. */
  value: number
}
/** A cycle that missed its deadline. */
export type LateCycle = {
  /** Time after the deadline [s]. */
  by: number
  /** Number of the cycle. */
  cycle: number
  /** Cause, in a sentence. */
  sentence: string
}
/** A friction of the library. */
export type LibraryFriction = {
  /** Breakaway torque [N m], kinetic torque [N m], Stribeck velocity [rad/s] and viscous friction [N m s/rad]. */
  desired: [number, number, number, number]
  /** Missing information. */
  lacks: string[]
  /** Its name. */
  name: string
  /** Factor of all torques. */
  scale: number
  /** Authors and method of identification. */
  source: string
  /** Title, one line. */
  title: string
}
/** A controller, friction or law loaded from a file. Times in seconds. */
export type LoadedStatus = {
  /** Allowed duration of a call. */
  budget: number
  /** Duration of a call: median, 99th and 99.9th percentile, longest. */
  call: [number, number, number, number]
  /** Number of calls. */
  calls: number
  /** Whether it has failed: no torque until it is opened again. */
  failed: boolean
  /** Its file. */
  file: string
  /** SHA-256 of the opened file, in hexadecimal digits. */
  hash: string
  /** Its kind: `C library`, `FMU 2.0`. */
  kind: string
  /** Number of late torques; the previous torque was held. */
  late: number
  /** Its name, from its description. */
  name: string
  /** Number of calls that took longer. */
  over_budget: number
  /** Time from request to response, likewise; `null` if it runs inside the bench's process. */
  response: [number, number, number, number] | null
  /** Its role in the loop: `controller`, `friction`, `law`. */
  role: string
  /** The parameter that selects it. */
  selector: string
}
/** A place in the page. */
export type Look = {
  /** Its name. */
  name: string
  /** Address of a window, or path of a group of parameters. */
  path: string
}
/** Presliding loop of slow motion back and forth from rest: the bristles without damping. */
export type Loop = {
  /** Way from the start [rad]. */
  angle: number[]
  /** Friction torque [N m]. */
  torque: number[]
}
/** A loop at one operating point. */
export type LoopAt = {
  /** Magnitude of the loop gain [dB]. */
  decibels: number[]
  /** Angle after a load torque step of 0.1 N m [mrad]; empty for an unstable loop. */
  disturbed: number[]
  /** Frequencies of the loop gain, rising [Hz]. */
  frequency: number[]
  /** Imaginary part of the loop gain. */
  imaginary: number[]
  /** `sliding` or `stuck`. */
  load: string
  /** Margins. */
  marks: LoopMark[]
  /** The numbers of `stickslip loop`. */
  numbers: LoopNumber[]
  /** How far the angle exceeds a set-point step, as a share of the step; `null` for an unstable loop. */
  overshoot: number | null
  /** Phase of the loop gain, without jumps [°]. */
  phase: number[]
  /** Poles of the plant. */
  plant: LoopPole[]
  /** Poles of the closed loop, the slowest first. */
  poles: LoopPole[]
  /** Real part of the loop gain. */
  real: number[]
  /** Angle after a set-point step of 1 rad [rad]; empty for an unstable loop. */
  setpoint: number[]
  /** Whether it is stable. */
  stable: boolean
  /** Instants of the step responses [s]. */
  time: number[]
}
/** A draft of a position controller. */
export type LoopDraft = {
  /** Dragged position of the pair of poles; a controller without specified poles becomes a state feedback with them. */
  drag?: PoleDrag
    | null
  /** Converts the controller to this kind, or uses the defaults of this kind. */
  kind?: DraftKind
    | null
  /** Largest overshoot of a set-point step, as a share: lowers the set-point weight; a cascade becomes a PID controller. */
  overshoot?: number | null
  /** Speed at which the load slides [rad/s]; default: 10. */
  speed?: number | null
  /** Whether the corners of the machine's uncertainty are checked as well; takes several times as long. */
  thorough?: boolean
  /** Values that differ from the active ones, by path, as in `set`. */
  values?: Record<string, string>
}
/** Robustness limits of a tuning. */
export type LoopLimits = {
  /** Circle in the Nyquist plot that the loop gain must not enter, from the limit of the sensitivity peak. */
  circle: [number, number][]
  /** Limit of the sensitivity peak in each corner. */
  corner: number
  /** Limit of the noise of the commanded torque [N m RMS]. */
  noise_torque: number
  /** Limit of the sensitivity peak, sliding and stuck. */
  sensitivity: number
}
/** A margin at its point of the loop gain. */
export type LoopMark = {
  /** Magnitude of the loop gain [dB]. */
  decibels: number
  /** Frequency [Hz]. */
  frequency: number
  /** Imaginary part of the loop gain. */
  imaginary: number
  /** Kind: `gain margin`, `phase margin`, `M_s`. */
  name: string
  /** Phase of the loop gain [°]. */
  phase: number
  /** Real part of the loop gain. */
  real: number
  /** Short label for a point in a picture: `GM 11.8 dB`. */
  short: string
  /** Kind, value and frequency in words. */
  text: string
}
/** A number of a loop. */
export type LoopNumber = {
  /** Key in `summary.json`, after `loop.sliding.`. */
  key: string
  /** Name. */
  name: string
  /** Unit: gain margins in dB, delays in ms, else SI. */
  unit: string
  /** Value in this unit; `null` if unlimited or if the loop is not stable. */
  value: number | null
}
/** A pole in continuous time, ln z/T. */
export type LoopPole = {
  /** Damping ratio; 1 on the negative real axis, negative if unstable. */
  damping: number
  /** Natural frequency [rad/s]. */
  frequency: number
  /** Imaginary part [rad/s]. */
  imaginary: number
  /** Real part [1/s]; negative if stable. */
  real: number
}
/** Robustness check of a loop. */
export type LoopVerdict = {
  /** Whether all robustness limits are met. */
  fair: boolean
  /** Reasons, in sentences. */
  sentences: string[]
  /** The worst corner. */
  worst: CornerView
}
/** A position controller on the identified model. */
export type LoopView = {
  /** The pair of poles that can be dragged; `null` for a controller given by matrices. */
  grip: PoleGrip
    | null
  /** The fields of the controller. */
  items: Item[]
  /** Kind of controller, as in a file. */
  kind: string
  /** Robustness limits. */
  limits: LoopLimits
  /** The loop with the load sliding, then stuck. */
  loads: LoopAt[]
  /** Directions of constant damping ratio. */
  rays: DampingRay[]
  /** Shown range of the pole plane [1/s]. */
  reach: number
  /** Values that differ from the active ones, by path, as for `set`. */
  values: Record<string, string>
  /** Robustness check; `null` unless the draft is thorough. */
  verdict: LoopVerdict
    | null
}
/** Lost or missed cycles. */
export type Loss = {
  /** Cause. */
  cause: string
  /** Number of lost or missed cycles. */
  count: number
  /** The first cycle after them. */
  cycle: number
  /** Remedy. */
  remedy: string
}
/** The modelled machine, for a picture. */
export type Machine = {
  /** Units of the angle, with the factor from rad. */
  angles: Factor[]
  /** Ends of the travel by the screw's angle [rad]. */
  ends: [number, number]
  /** The parts, starting with the drive motor. */
  parts: Part[]
  /** Units of the velocity, with the factor from rad/s. */
  speeds: Factor[]
}
/** A manoeuvre. */
export type ManoeuvreForm = {
  /** Its duration [s]. */
  duration: number
  /** Smallest and largest position, from its start [rad]. */
  extent: [number, number]
  /** Its name, for calls. */
  name: string
  /** Whether it measures tracking and ranks the controllers. */
  ranks: boolean
  /** Its title. */
  title: string
}
/** An event in a cycle. */
export type Mark = {
  /** Number of the cycle; for an event outside the loop, the newest cycle at that time. */
  cycle: number
  /** Kind of the event. */
  kind: MarkKind
  /** Description. */
  text: string
}
/** Kind of an event. */
export type MarkKind = "fault"
  | "change"
  | "begin"
  | "end"
/** A friction curve, complete or during its measurement. */
export type MeasuredCurve = {
  /** Noisy samples, velocity [rad/s] and torque [N m] of each part; empty for an earlier run. */
  course: [number, number][]
  /** The Stribeck curve through the points. */
  fit: FittedCurve
    | null
  /** Whether the measurement is running. */
  measuring: boolean
  /** Why there is no fit, and which points are not used, each with a remedy. */
  notes: string[]
  /** The points used by the fit. */
  points: MeasuredPoint[]
  /** Whether the load motor rendered the desired friction. */
  rendered: boolean
  /** Number of the run; `null` during the measurement and if there is none. */
  run: number | null
}
/** A point of a friction curve. */
export type MeasuredPoint = {
  /** Half the width of its 95 % interval [N m]. */
  half_width: number
  /** Measured minus fitted torque [N m]; `null` without a fit. */
  residual: number | null
  /** Torque, with the sign of the velocity [N m]. */
  torque: number
  /** Velocity [rad/s]. */
  velocity: number
}
/** The nearest limit of the region. */
export type NearestLimit = {
  /** Available value. */
  available: number
  /** Remaining share of the way to the limit, 0 … 1; 0: exceeded. */
  left: number
  /** `drive`, `current`, `voltage`, `slope`, `response`, `speed`. */
  limit: string
  /** Required value. */
  needed: number
  /** Speed at which it is nearest [rad/s]. */
  speed: number
  /** SI unit of both. */
  unit: string
}
/** A signal of one of several overlaid runs. */
export type OverlaidRun = {
  /** The signal over the time of its own run. */
  course: Course
    | null
  /** Number of the run. */
  number: number
  /** Offset to add to its time [s]; `null` if it cannot be aligned. */
  shift: number | null
  /** Why there is no signal. */
  trouble: string | null
}
/** A score of two trials. */
export type PairRow = {
  /** Value of A; `null` if it is not defined for its motion. */
  a: number | null
  /** Value of B. */
  b: number | null
  /** Whether the 95 % intervals overlap; `null` without intervals. */
  overlaps: boolean | null
  /** B over A, less 1 [%]. */
  percent: number | null
  /** Its title. */
  title: string
  /** The unit of the numbers. */
  unit: string
}
/** A part of the machine. */
export type Part = {
  /** Its key number, as text. */
  about: string
  /** Group of its parameters. */
  group: string
  /** Kind of part. */
  kind: PartKind
  /** Name. */
  name: string
}
/** Kind of a machine's part. */
export type PartKind = "drive_motor"
  | "coupling"
  | "screw"
  | "wheel"
  | "load_motor"
  | "encoder"
/** A part of the history. */
export type Past = {
  /** Number of cycles of the returned blocks. */
  block: number
  /** Number of cycles of the finest blocks. */
  finest: number
  /** The first cycle of the first block. */
  from: number
  /** Largest value in each block. */
  high: ((number | null)[])[]
  /** Smallest value in each block, for each signal; `null` without a finite value. */
  low: ((number | null)[])[]
  /** The cycle after the newest one. */
  next: number
  /** The oldest cycle of the history. */
  oldest: number
}
/** A figure with its caption. */
export type Picture = {
  /** The caption. */
  caption: string
  /** The figure. */
  figure: Figure
}
/** A plan of a measurement. */
export type PlanForm = {
  /** Short description. */
  about: string
  /** Bench time [s], without homing. */
  duration: number
  /** Its values. */
  items: Item[]
}
/** A point of a stream: smallest and largest sample of its window. */
export type Point = {
  /** First cycle. */
  from: number
  /** Last value of each signal; `null` if not finite. */
  last: (number | null)[]
  /** Largest value of each signal; `null` if not finite. */
  max: (number | null)[]
  /** Smallest value of each signal; `null` if not finite. */
  min: (number | null)[]
  /** Missing cycles since the previous point: lost, or in points that were not read in time. */
  missing: number
  /** Whether the window contains a NaN, for each signal. */
  nan: boolean[]
  /** Last cycle. */
  to: number
}
/** Dragged position of a pair of poles. */
export type PoleDrag = {
  /** Imaginary part [rad/s]. */
  imaginary: number
  /** Real part [1/s]. */
  real: number
}
/** A pair of poles that can be dragged. */
export type PoleGrip = {
  /** Natural frequency [rad/s]. */
  bandwidth: number
  /** Whether a drag replaces the controller by a state feedback with specified poles. */
  converts: boolean
  /** Damping ratio. */
  damping: number
  /** Imaginary part of the upper pole [rad/s], at least 0. */
  imaginary: number
  /** Real part of the upper pole [1/s]. */
  real: number
}
/** A quantity to measure. */
export type Quantity = "friction"
  | "breakaway"
  | "presliding"
/** A measure. */
export type RankColumn = {
  /** Its title. */
  title: string
  /** The unit of its numbers. */
  unit: string
}
/** A controller of a comparison. */
export type RankRow = {
  /** 95 % interval of the factor over the repetitions. */
  ci95: [number, number] | null
  /** Its name. */
  controller: string
  /** Deviations of the first chosen controller over its own, geometric mean of the tracking measures. */
  factor: number | null
  /** Number of failed runs. */
  failures: number
  /** First and last place within its interval; `null` without a rank. */
  place: [number, number] | null
  /** Numbers of its trials, one for each manoeuvre. */
  trials: number[]
  /** Mean and half of the 95 % interval of each measure. */
  values: ([number, number] | null)[]
}
/** Amount of recorded data. */
export type Recorded = {
  /** Size of the file [bytes]. */
  bytes: number
  /** The first cycle. */
  from: number
  /** Length [s]. */
  length: number
  /** Cycles that are missing in the file. */
  lost: number
}
/** The records of measurements in a project. */
export type Records = {
  /** Number of runs with such a record. */
  count: number
  /** Their limit [bytes]; 0: measurements are not recorded. */
  limit: number
  /** Number of runs whose record was removed for newer ones. */
  removed: number
  /** Their size [bytes]. */
  used: number
}
/** A reference point. */
export type Reference = {
  /** Speed, at least 0 [rad/s]. */
  speed: number
  /** Torque, above 0 [N m]. */
  torque: number
  /** Weight relative to other points. */
  weight?: number
}
/** A measured rendered friction, complete or during its measurement. */
export type RenderedFriction = {
  /** Own and desired friction, desired and rendered friction, load torque, sweep through standstill: figures 12, 13 and 14 of the paper, and a detail of 14. */
  figures: Picture[]
  /** The key numbers. */
  keys: KeyEstimate[]
  /** Whether the measurement is running. */
  measuring: boolean
  /** Whether the desired friction was rendered; `null` without a measurement. */
  outcome: Verdict
    | null
  /** Number of the run; `null` during the measurement and if there is none. */
  run: number | null
  /** The outcome with its reasons, in sentences. */
  verdict: string
}
/** Progress or result of a replay. */
export type ReplayProgress = {
  /** Whether it has ended. */
  ended: boolean
  /** Completed share, 0 … 1. */
  fraction: number
  /** Whether the whole run was replayed and every bit is the same; `null` before the end. */
  identical: boolean | null
  /** Number of the run. */
  run: number
  /** Result, or reason of the end. */
  sentence: string | null
}
/** Meaning of a series: it has the same colour in every figure. */
export type Role = "measured"
  | "fitted"
  | "desired"
  | "own"
  | "rendered"
  | "reference"
  | {
  trace: number
}
/** A run of the catalogue. */
export type Run = {
  /** Start time, RFC 3339, UTC. */
  begun: string
  /** The command line. */
  command: string
  /** The position controller under test. */
  controller: string
  /** Its friction curve in at most 64 points: velocity [rad/s], torque [N m]. */
  curve: [number, number][]
  /** Bench time, or elapsed time of a run without a bench [s]. */
  duration: number | null
  /** Its files. */
  files: string[]
  /** Folder, relative to the project's folder. */
  folder: string
  /** Why it was not completed; `null` if it was. */
  incomplete: string | null
  /** The key number. */
  key: KeyNumber
    | null
  /** Its command: `demo`, `measure friction`; or `recording`. */
  kind: string
  /** The rendering law. */
  law: string
  /** Name. */
  name: string
  /** Note of the user. */
  note: string
  /** Number, unique in the project. */
  number: number
  /** The preset in its command; may be empty. */
  preset: string
  /** The file that can be replayed. */
  record: string | null
  /** Whether its record was removed, because the records of the project reached their limit. */
  record_removed: boolean
  /** Availability of its files. */
  state: State
  /** Tags, sorted. */
  tags: string[]
  /** Version of the program. */
  version: string
}
/** An event of a run. */
export type RunEvent = {
  /** Number of the cycle. */
  cycle: number
  /** Details: changed values, reason of a refusal. */
  details: string[]
  /** Time of the cycle [s]. */
  time: number
  /** Whether it is a fault, a refusal or a loss. */
  trouble: boolean
  /** In a few words. */
  what: string
}
/** State of a fieldbus segment. Times in seconds. */
export type SegmentStatus = {
  /** Working counter of the last frame that returned. */
  counter: number
  /** Its devices, in their order. */
  devices: DeviceStatus[]
  /** Distance from that middle: median, 99th and 99.9th percentile, largest; at most half a period. */
  distance: [number, number, number, number]
  /** Histogram of the distance. */
  distance_bins: TimeBin[]
  /** Expected working counter. */
  expected: number
  /** Number of frames with process data. */
  frames: number
  /** The same in the last second. */
  last_second: FrameOffset
  /** Of these, frames that did not return in time. */
  lost: number
  /** Place of the frames relative to the middle between two pulses of SYNC0, since the start. */
  offset: FrameOffset
  /** Time from sending to receiving a frame, likewise. */
  round_trip: [number, number, number, number]
  /** Histogram of the time from sending to receiving. */
  round_trip_bins: TimeBin[]
  /** Of these, frames with another working counter than expected. */
  wrong: number
}
/** Values with a role and a name. Values that are not finite or beyond 1e15 are omitted; a line has a gap there. */
export type Series = {
  /** A dashed line, for any role. */
  dashed?: boolean
  /** Its values. */
  data: Data
  /** Larger points. */
  large?: boolean
  /** Name in the legend. */
  name: string
  /** The role. */
  role: Role
}
/** Result of a requested setting. */
export type SettingResult = {
  /** Effect of the refusal; empty if granted. */
  costs: string
  /** Message of the system, if it refused. */
  refused: string | null
  /** The command that fixes it. */
  remedy: string | null
  /** The requested setting. */
  setting: string
}
/** A signal. */
export type Signal = {
  /** Description. */
  help: string
  /** Its label. */
  label: string
  /** Its name. */
  name: string
  /** Unit as printed; empty for a pure number. */
  printed_unit: string
  /** Symbol in equations; may be empty. */
  symbol: string
  /** SI unit. */
  unit: string
  /** Names of its values, from 0 on; empty for a measured quantity. */
  values: string[]
}
/** Simulation of a recorded run with other parameters. */
export type Simulated = {
  /** Number of simulated cycles. */
  cycles: number
  /** Reason of an end before the end of the record. */
  ended: string | null
  /** Time of the first cycle [s]. */
  from: number
  /** Ratio of bench time to computing time. */
  speed: number
  /** Time of each part of a trace [s]. */
  time: number[]
  /** Time of the last simulated cycle [s]. */
  to: number
  /** The requested signals. */
  traces: Trace[]
}
/** A speed range in which a limit is exceeded. */
export type SpeedRange = {
  /** Lower end [rad/s]. */
  from: number
  /** As [`NearestLimit::limit`]. */
  limit: string
  /** Reason, in a sentence. */
  reason: string
  /** Upper end [rad/s]. */
  to: number
}
/** Availability of a run's files. */
export type State = "here"
  | "missing"
  | "replaced"
  | "deleted"
/** Status of the running bench. */
export type Status = {
  /** Screw angle [rad]. */
  angle: number
  /** The client that requests to become the operator. */
  asks: string | null
  /** Number of parameters that differ from those at the start of the run. */
  changed: number
  /** Timing of the real-time loop. */
  clock: ClockStatus
  /** Number of the newest cycle. */
  cycle: number
  /** The running motion or measurement; `null`: none. */
  doing: CurrentTask
    | null
  /** Torque of the drive motor [N m]. */
  drive_torque: number
  /** Number of values that differ in the state before the start of the program; `null`: nothing to restore. */
  earlier: number | null
  /** The fault with its remedy. */
  fault: FaultStatus
    | null
  /** End of the last motion or measurement. */
  last: Ended
    | null
  /** Counters of the link to the machine, if it is in another process. */
  link?: Counts
    | null
  /** Torque of the load motor, against positive motion [N m]. */
  load_torque: number
  /** The loaded external controller, friction or law. */
  loaded?: LoadedStatus
    | null
  /** Number of marks since the start. */
  marks: number
  /** Amount of recorded data of the running measurement; `null` if it is not recorded. */
  measurement_record: Recorded
    | null
  /** Why the last run is not in the catalogue. */
  not_entered: string | null
  /** Why the state of the target or the record of the last measurement is not saved, or not read. */
  not_saved: string | null
  /** The operator: the client that may change the bench. */
  operator: string | null
  /** Preload of the friction wheel, 0 … 1. */
  preload: number
  /** Name of the preset. */
  preset: string
  /** Tick rate [Hz]. */
  rate: number
  /** Reason of a fault or of the end. */
  reason: string | null
  /** Amount of recorded data, also of a recording that broke off. */
  recorded: Recorded
    | null
  /** The recorded file, or why the recording broke off. */
  recording: string | null
  /** Whether a change can be redone. */
  redo: boolean
  /** Whether the load motor renders the desired friction. */
  render: boolean
  /** State of the segment, if the machine is on a fieldbus. */
  segment?: SegmentStatus
    | null
  /** `off`, `homing`, `ready`, `running`, `stopping`, `fault`, or `ended` after the end of the loop. */
  state: string
  /** Whether a change can be undone. */
  undo: boolean
  /** Estimated velocity [rad/s]. */
  velocity: number
  /** Addresses for measurement and calibration tools. */
  xcp: XcpStatus[]
}
/** The running program. */
export type Target = {
  /** Target of the build: processor, system, and whether overflows are checked. */
  built: string
  /** Files for download, at `/implementation/FILE`. */
  files: TargetFile[]
  /** The machine: `virtual`, or its address. */
  machine: string
  /** Tick rate [Hz]. */
  rate: number
  /** Start time: seconds since 1970 [s]. */
  since: number
  /** Requested settings of the real-time thread, each with its result. */
  thread_settings: SettingResult[]
  /** Version of the program. */
  version: string
}
/** A file of the running software. */
export type TargetFile = {
  /** Content. */
  about: string
  /** Its path. */
  file: string
  /** Name. */
  name: string
}
/** A bar of a histogram. */
export type TimeBin = {
  /** Number of values. */
  count: number
  /** Lower edge [s]. */
  from: number
  /** Upper edge, exclusive [s]. */
  to: number
}
/** Execution time of a part. */
export type TimedPart = {
  /** Longest time [s]. */
  longest: number
  /** Median [s]. */
  median: number
  /** Name of the part. */
  name: string
  /** 99.9th percentile [s]. */
  p999: number
}
/** Execution times of the cycles. Times in seconds. */
export type Timing = {
  /** Histogram of the whole cycle, from its wake-up to the end of its work. */
  bins: TimeBin[]
  /** Number of counted cycles. */
  cycles: number
  /** The last cycles that missed their deadline, the newest first. */
  late: LateCycle[]
  /** Number of cycles missed because of them. */
  missed: number
  /** Number of missed deadlines. */
  overruns: number
  /** Lateness, the whole cycle, and its parts in their order. */
  parts: TimedPart[]
  /** Period of the cycles: the available time. */
  period: number
}
/** A recorded and a simulated signal, with minimum and maximum in each part of the time, so that no spike is lost. */
export type Trace = {
  /** Simulated minus recorded. */
  difference: [(number | null)[], (number | null)[]]
  /** Its largest magnitude. */
  peak: number | null
  /** As recorded: minimum and maximum. */
  recorded: [(number | null)[], (number | null)[]]
  /** RMS of the difference over all cycles; `null` if a value is not finite. */
  rms: number | null
  /** Its name. */
  signal: string
  /** As simulated. */
  simulated: [(number | null)[], (number | null)[]]
  /** As in an equation; may be empty. */
  symbol: string
  /** SI unit. */
  unit: string
}
/** The manoeuvres and controllers that can be tried, and the limits of motions. */
export type TrialChoices = {
  /** The active controller with compensation and hold. */
  active: string
  /** The controllers of the benchmark. */
  controllers: string[]
  /** The desired friction. */
  desired: string
  /** The manoeuvres of the benchmark. */
  manoeuvres: ManoeuvreForm[]
  /** Why the desired friction cannot be rendered; `null` if it can. */
  not_rendered: string | null
  /** The own friction of the axis. */
  own: string
  /** Largest speed [rad/s]. */
  speed: number
  /** Ends of the travel for motions [rad]. */
  travel: [number, number]
}
/** A trial in a picture. */
export type TrialCourse = {
  /** Controller and friction. */
  name: string
  /** Number of its repetitions. */
  repetitions: number
  /** Number of its run. */
  run: number
  /** The curve. */
  trace: TrialTrace
}
/** A table of positions over time: two columns, time [s] and position in rad, mm, µm or m. */
export type TrialFile = {
  /** Its name. */
  name: string
  /** Its text. */
  text: string
}
/** One or two trials for a picture. */
export type TrialPair = {
  /** The curves, A first. */
  courses: TrialCourse[]
  /** B minus A; `null` for one trial or different motions. */
  difference: TrialTrace
    | null
  /** RMS of the difference. */
  difference_rms: number | null
  /** Reason for a missing difference. */
  note: string | null
  /** The scores of both. */
  rows: PairRow[]
  /** Unit of the curves. */
  unit: string
}
/** A trial in the table. */
export type TrialRow = {
  /** Whether all repetitions were completed. */
  complete: boolean
  /** The controller with compensation and hold. */
  controller: string
  /** The friction. */
  friction: string
  /** Title of the motion. */
  motion: string
  /** Number of completed repetitions. */
  repetitions: number
  /** Number of the run. */
  run: number
  /** Its scores, the same ones for each trial. */
  values: TrialValue[]
}
/** A signal of a trial. */
export type TrialSignal = "deviation"
  | "position"
  | "velocity"
  | "torque"
/** A curve as extremes of intervals of time, which keep every spike. */
export type TrialTrace = {
  /** Largest value in each interval. */
  largest: number[]
  /** Smallest value in each interval. */
  least: number[]
  /** Start of each interval [s]. */
  time: number[]
}
/** A score of a trial. */
export type TrialValue = {
  /** Half of the 95 % interval of the mean; `null` for one repetition. */
  half_width: number | null
  /** Its title. */
  title: string
  /** The unit of the numbers. */
  unit: string
  /** Mean over the repetitions; `null` if it is not defined for the motion. */
  value: number | null
}
/** Progress or result of a tuning. */
export type TuneProgress = {
  /** The client that started it. */
  by: string
  /** Whether it has ended. */
  ended: boolean
  /** Completed share of the longest search, 0 … 1. */
  fraction: number
  /** Number of the tuning; 0: none yet. */
  number: number
  /** Result, or reason of the failure. */
  sentence: string | null
  /** Tuned values that differ from those active at its start, by path; `null` before the end and after a failure. */
  values: Record<string, string> | null
}
/** A parameter or a result. */
export type Value = {
  /** Numeric value; `null` for a text. */
  number: number | null
  /** Dotted path. */
  path: string
  /** Whether it is a result; otherwise it is a parameter. */
  result: boolean
  /** Symbol in equations; may be empty. */
  symbol: string
  /** Value as text. */
  text: string
  /** SI unit. */
  unit: string
}
/** Whether a desired friction was rendered. */
export type Verdict = "met"
  | "not_met"
  | "incomplete"
/** An XCP address of the bench. */
export type XcpStatus = {
  /** IP address and port. */
  address: string
  /** Rows of measurements lost since the start. */
  lost: number
  /** The address of the connected master. */
  master: string | null
  /** Whether the master measures. */
  measuring: boolean
  /** `udp` or `tcp`. */
  transport: string
}
