// Generated from the schema of the protocol; do not edit. See crates/app/tests/protocol.rs.
/** A question or an order. In JSON an object with the key `call`: `{"call": "set", "values": {"bench.law.kind": "bristle"}}`. */
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
  call: "acknowledge"
}
  | {
  call: "halt"
}
  | {
  call: "move"
  /** What to follow: `sine`, `steps`, `point-to-point`, … */
  reference: string
  /** Whether the load motor renders the desired friction meanwhile. */
  render?: boolean
  /** Its values by name, SI units; those that are not given have their defaults. */
  values?: Record<string, number>
}
  | {
  call: "inject"
  /** What, and how much: `encoder-stuck`, `counts-lost=0.02`. */
  fault: string
}
  | {
  call: "preload"
  /** How far. */
  preload: number
}
  | {
  call: "measure"
  /** Values of its plan, as in a file. */
  plan?: Record<string, string>
  /** Of the friction: while the load motor renders the desired one. */
  render?: boolean
  /** What to measure. */
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
  /** As it was saved. */
  name: string
}
  | {
  call: "sets"
}
  | {
  call: "parameters"
}
  | {
  call: "differences"
}
  | {
  call: "items"
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
  /** Its file, as `flow` names it. */
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
  /** Values that are not as there. */
  plan?: Record<string, string>
  /** The thorough plan instead of the default. */
  thorough?: boolean
  /** What would be measured. */
  what: Quantity
}
  | {
  call: "curve"
  /** Number of its run; `null`: the one that is being measured, or was last. */
  run?: number | null
}
  | {
  call: "curves"
}
  | {
  call: "rendered"
  /** Number of its run; `null`: the one that is being measured, or was last. */
  run?: number | null
}
  | {
  call: "at_rest"
  /** Number of its run; `null`: the one that is being measured, or was last. */
  run?: number | null
  /** Which. */
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
  /** A hand on the wanted pair of poles. */
  drag?: PoleDrag
    | null
  /** The controller as the other kind that it is, or that kind's defaults. */
  kind?: DraftKind
    | null
  /** Speed at which the load slides [rad/s]; 10 where it is not given. */
  speed?: number | null
  /** Whether the corners of what may be wrong with the machine are judged as well: several times the time. */
  thorough?: boolean
  /** What is not as in force: value by path, as in `set`. */
  values?: Record<string, string>
}
  | {
  call: "hunting"
  /** On the desired friction, which the load motor renders, instead of the machine's own. */
  desired?: boolean
  /** The draft. */
  draft?: LoopDraft
}
  | {
  call: "tune"
  /** A hand on the wanted pair of poles. */
  drag?: PoleDrag
    | null
  /** The controller as the other kind that it is, or that kind's defaults. */
  kind?: DraftKind
    | null
  /** Speed at which the load slides [rad/s]; 10 where it is not given. */
  speed?: number | null
  /** Whether the corners of what may be wrong with the machine are judged as well: several times the time. */
  thorough?: boolean
  /** What is not as in force: value by path, as in `set`. */
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
  /** Time after it [s]. */
  after: number
  /** Time before the trigger [s]. */
  before: number
  call: "capture"
  /** Of so many ticks one is kept, at least 1. */
  decimation?: number
  /** Names of the signals. */
  signals: string[]
  /** When: `immediate`, `setpoint.velocity rises through 0.1`, … */
  trigger: string
}
  | {
  call: "fetch"
  /** Its number. */
  capture: number
}
  | {
  call: "stream"
  /** From point to point [s], a tick at least. */
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
  /** At most so many. */
  limit?: number
  /** Words, `law:bristle`, `M_S>0.2`, `-tag:bad`; empty for all. */
  query?: string
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
  /** So much of the run, from its begin on [s]; at most 120. */
  length: number
  /** Its number. */
  number: number
  /** Parts of the time in a trace; at most 4000. */
  parts: number
  /** Names of the signals that are told. */
  signals: string[]
  /** Value by path, as in `set`; what of the machine is another as well. */
  values?: Record<string, string>
}
  | {
  /** How they are laid. */
  align: Alignment
  call: "courses"
  /** Only what then lies from here [s] … */
  from?: number | null
  /** Their numbers; at most six. */
  numbers: number[]
  /** Parts of the time in a course; at most 4000. */
  parts: number
  /** Name of the signal. */
  signal: string
  /** … to here [s]. */
  to?: number | null
}
  | {
  call: "story"
  /** Its number. */
  number: number
}
  | {
  call: "rename_run"
  /** In words. */
  name: string
  /** Its number. */
  number: number
}
  | {
  /** Words. */
  add?: string[]
  call: "tag_run"
  /** Its number. */
  number: number
  /** Words. */
  remove?: string[]
}
  | {
  call: "note_run"
  /** Empty to take it away. */
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
  /** Whether it is given. */
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
  /** With this cycle. */
  cycle: number
  /** What became another. */
  differences: Changed[]
  /** How far the rendering law is from chatter, in words, where it became another. */
  margin: string | null
}
  | {
  answer: "differences"
  /** Each value. */
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
  | RenderedFriction & {
  answer: "rendered"
}
  | BreakawayMeasurement & {
  answer: "at_rest"
}
  | AdvisedPreload & {
  answer: "advised_preload"
}
  | {
  answer: "losses"
  /** Cycles that were held: a deadline was missed, or a virtual machine waited for a command; the newest last. */
  held: Loss[]
  /** Cycles that recorders and viewers did not get, the newest last. */
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
  /** As it is. */
  text: string
}
  | {
  answer: "names"
  /** Sorted. */
  names: string[]
}
  | {
  answer: "signals"
  /** Names of those that are looked at first, together with which. */
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
  /** Each. */
  points: Point[]
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
  | {
  answer: "runs"
  /** What of the query was not understood and left out. */
  hints: string[]
  /** How many the query finds, these among them. */
  of: number
  /** The newest first. */
  runs: Run[]
}
  | {
  answer: "run"
  /** The ends of the names as which its record leaves for other tools: `/run/NUMBER/run.mf4?as=parquet`. */
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
  /** The parameters that are others. */
  differences: Changed[]
  /** Its traces. */
  simulated: Simulated
}
  | {
  answer: "courses"
  /** In the order in which they were asked for. */
  courses: OverlaidRun[]
}
  | {
  answer: "story"
  /** In its order. */
  happened: RunEvent[]
}
/** A preload that is advised. */
export type AdvisedPreload = {
  /** Whether somebody has to press the linings on by hand. */
  by_hand: boolean
  /** Whether the desired friction needs another preload than the one that is set. */
  needed: boolean
  /** The one that it needs, 0 … 1; `null` where that is not known, or any will do. */
  preload: number | null
  /** Why, and what to do. */
  sentence: string
}
/** How courses are laid over each other. */
export type Alignment = {
  by: "begin"
}
  | {
  by: "rise"
  /** In the signal's unit. */
  level: number
}
  | {
  by: "correlation"
}
  | {
  by: "hand"
  /** What is added to the time of each [s]. */
  shifts: number[]
}
/** What an axis shows and how. */
export type Axis = {
  /** ln x instead of x. */
  logarithmic?: boolean
  /** What it shows. */
  quantity: string
  /** Chosen, not by the data. */
  range?: [number, number] | null
  /** asinh(x/2) instead of x. */
  stretched: boolean
  /** As in a field. */
  unit: string
}
/** How large a block is, with all that it calls. */
export type BlockSize = {
  /** Lines of C. */
  lines: number
  /** Operations of a step. */
  operations: number
  /** Numbers among its parameters. */
  parameters: number
  /** Numbers that it remembers. */
  states: number
}
/** An error of the compiler. */
export type BuildError = {
  /** The block. */
  block: string
  /** The page of the block's diagram, where the line is one of a block's. */
  page: string | null
  /** File and line. */
  place: string
  /** What the compiler says. */
  text: string
}
/** How far a build is, or what came of it. */
export type BuildProgress = {
  /** Errors of the compiler. */
  errors: BuildError[]
  /** Where the files are. */
  folder: string
  /** Commands and what they wrote. */
  log: string
  /** What the compiler took, and the test [s]. */
  seconds: [number, number] | null
  /** What came of it, in a sentence. */
  sentence: string
  /** Size of the object: code and constants, data, zeroed data [bytes]; `null` where nobody tells. */
  sizes: [number, number, number] | null
  /** How far. */
  stage: BuildStage
}
/** How far a build is. */
export type BuildStage = "never"
  | "compiling"
  | "testing"
  | "passed"
  | "failed"
  | "no_compiler"
  | "cancelled"
/** What was captured. */
export type Captured = {
  /** Of each signal its value in each row; `null` where it is no number. */
  columns: ((number | null)[])[]
  /** Number of the cycle of each row. */
  cycles: number[]
  /** Cycles that are lost. */
  lost: number
  /** Ticks of history that were asked for but not there yet. */
  missing: number
  /** Names of the columns. */
  signals: string[]
  /** Its time, 0 at the trigger [s]. */
  times: number[]
  /** Index of the trigger's row. */
  trigger: number
}
/** A value that is not the same. */
export type Changed = {
  /** After, with its unit. */
  after: string | null
  /** Before, with its unit. */
  before: string | null
  /** Its dotted path. */
  path: string
}
/** Something to choose. */
export type Choice = {
  /** What it is. */
  help: string
  /** As in files. */
  name: string
}
/** How the clock is kept. Times in seconds. */
export type ClockStatus = {
  /** A whole cycle, likewise. */
  cycle: [number, number, number, number]
  /** Cycles that were held: a deadline was missed, or a virtual machine waited for a command. */
  held: number
  /** From the deadline to the begin of a cycle: median, 99th and 99.9th percentile, longest. */
  lateness: [number, number, number, number]
  /** Share of a tick that a cycle takes: median. */
  load: number
  /** Cycles that found no room on their way to recorders and viewers. */
  lost: number
}
/** A machine that is off by a factor each. */
export type CornerView = {
  /** Factor of the coupling stiffness. */
  coupling_stiffness: number
  /** `sliding` or `stuck`. */
  load: string
  /** Factor of the load inertia. */
  load_inertia: number
  /** Peak of the sensitivity; `null` where the loop is not stable. */
  sensitivity: number | null
}
/** What they say. */
export type Counts = {
  /** Ticks whose readings came in time. */
  answered: number
  /** How often the machine was taken up. */
  begun: number
  /** Answers that came a second time. */
  doubled: number
  /** Frames that could not be read, on either side. */
  garbled: number
  /** Answers that came behind their tick. */
  late: number
  /** Ticks whose readings did not. */
  missing: number
}
/** A signal of a run over time. Of each part of the time the least and the largest value, so that no spike is lost. */
export type Course = {
  /** Time of the record's first row [s]. */
  begin: number
  /** Time of its last [s]. */
  end: number
  /** Middle of each part of the time [s]. */
  time: number[]
  /** SI unit. */
  unit: string
  /** Least and largest value in each; `null` where rows are lost. */
  values: [(number | null)[], (number | null)[]]
}
/** A run that has a friction curve. */
export type CurveName = {
  /** Name of its folder. */
  name: string
  /** Whether the load motor rendered meanwhile. */
  rendered: boolean
  /** Its number. */
  run: number
}
/** The direction in which poles of a damping ratio lie. */
export type DampingRay = {
  /** The damping ratio. */
  damping: number
  /** Of a unit vector; the other ray has the opposite sign. */
  imaginary: number
  /** Of a unit vector. */
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
/** A page of the generated signal-flow diagram. */
export type DiagramPage = {
  /** The functions in C, those that are called first. */
  code: string
  /** What it shows. */
  name: string
  /** Its file, as links between pages name it. */
  page: string
  /** How much that is. */
  size: BlockSize
  /** The picture; its boxes link to pages. */
  svg: string
}
/** What runs. */
export type CurrentTask = {
  /** The part of the stage that is done, 0 … 1. */
  fraction: number
  /** How far it is, in words. */
  stage: string
  /** What it is: `sine`, `measure friction`. */
  what: string
}
/** What a draft can be made of. */
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
  /** As [`Sketch::desired`]. */
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
}
/** A part of an edge of the renderable region. */
export type Edge = {
  /** Lower end [rad/s]. */
  from: number
  /** Whether it is the edge of the largest friction, not of the smallest. */
  largest: boolean
  /** `current`, `voltage`; `wheel` where the law renders no torque and the friction wheel alone acts. */
  limit: string
  /** Upper end [rad/s]. */
  to: number
}
/** How something ended. */
export type Ended = {
  /** Why, where it failed or was cancelled. */
  error: string | null
  /** Where its results are. */
  folder: string | null
  /** What it was. */
  what: string
}
/** A unit that a quantity may be shown in. */
export type Factor = {
  /** What a value in SI units is multiplied by. */
  factor: number
  /** As printed. */
  unit: string
}
/** A plot. Points are drawn first, then bands, then lines, so that no cloud hides a curve. */
export type Figure = {
  /** Parts of the horizontal axis that have a name. */
  intervals?: Interval[]
  /** What is drawn. */
  series: Series[]
  /** What it is called. */
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
  /** What the data leave open, and which measurement would tell. */
  findings: string[]
  /** The same as a share of the breakaway torque; `null` where that is 0. */
  misfit: number | null
  /** The values that make it the own friction, by path, as for `set`; empty where a parameter is not known. */
  own: Record<string, string>
  /** Its parameters. */
  parameters: FittedParameter[]
  /** RMS of what it leaves [N m]. */
  rms: number
  /** Its torques [N m]. */
  torque: (number | null)[]
  /** Velocities of the line, rising; `null` is the gap at standstill [rad/s]. */
  velocity: (number | null)[]
}
/** A parameter of a fit. */
export type FittedParameter = {
  /** Half of its 95 % interval as printed, without the sign. */
  half_width: string
  /** As in files. */
  key: string
  /** Whether the data tell it. */
  known: boolean
  /** What it is. */
  name: string
  /** As in an equation. */
  symbol: string
  /** The unit of both, with its prefix. */
  unit: string
  /** The value as printed; `unknown` where the data do not tell. */
  value: string
}
/** What runs, at a glance. Places in units of the picture, from its left upper corner. */
export type Flow = {
  /** The blocks, in the order of the signal. */
  blocks: FlowBlock[]
  /** All pages of the generated diagram, the whole first. */
  pages: FlowPage[]
  /** Width and height. */
  size: [number, number]
  /** What connects them. */
  wires: FlowWire[]
}
/** A block. */
export type FlowBlock = {
  /** What it does. */
  about: string
  /** Left, upper edge, width, height. */
  at: [number, number, number, number]
  /** Paths of those that are not as they were when the run began. */
  changed: string[]
  /** Which of its kind is chosen; empty where there is no choice. */
  choice: string
  /** Where its parameters are. */
  groups: FlowGroup[]
  /** Where the guide tells of it. */
  guide: string | null
  /** Which. */
  id: string
  /** Its name. */
  name: string
  /** The page of the diagram that shows it from inside. */
  page: string | null
}
/** Parameters that belong together. */
export type FlowGroup = {
  /** Why they cannot be changed while the bench runs, and what to do instead. */
  fixed: string | null
  /** What their paths begin with. */
  path: string
}
/** A page of the generated diagram. */
export type FlowPage = {
  /** What it shows. */
  name: string
  /** Its file, as links between pages name it. */
  page: string
}
/** A wire. */
export type FlowWire = {
  /** The block that it leaves. */
  from: string
  /** Where the value stands; `null` on a branch of a wire that says it already. */
  label: [number, number] | null
  /** Its corners; the arrow is at the last. */
  points: [number, number][]
  /** The signal that it carries. */
  signal: string
  /** The block that it enters. */
  to: string
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
/** Something that happened in a run. */
export type RunEvent = {
  /** With this cycle. */
  cycle: number
  /** More of it: what became another, why it was refused. */
  details: string[]
  /** Time of the cycle [s]. */
  time: number
  /** Whether it is a fault, a refusal or a loss. */
  trouble: boolean
  /** In a few words. */
  what: string
}
/** Whether a controller hunts at a set-point that rests: the numbers of `stickslip hunting`. */
export type HuntingView = {
  /** Half the distance between the extremes [rad]; `null` where it comes to rest. */
  amplitude: number | null
  /** The same in counts of the encoder. */
  counts: number | null
  /** Of the desired friction, which the load motor renders, instead of the machine's own. */
  desired: boolean
  /** Deviations from the set-point [mrad]. */
  deviation: number[]
  /** Whether it hunts. */
  hunts: boolean
  /** From one slip to the next [s]. */
  interval: number | null
  /** It in words. */
  sentence: string
  /** Instants of the course [s]. */
  time: number[]
}
/** A part of the horizontal axis with a name. */
export type Interval = {
  /** Its begin. */
  from: number
  /** Its name. */
  name: string
  /** Its end. */
  to: number
}
/** One value of a parameter set, with what is known of it. */
export type Item = {
  /** What was chosen; `null` for a number. */
  choice: string | null
  /** Value unless given. */
  default: number | null
  /** What it is. */
  help: string
  /** What kind of value it is. */
  kind: ItemKind
  /** Largest value; `null`: any. */
  maximum: number | null
  /** Smallest value; `null`: any. */
  minimum: number | null
  /** What there is to choose from. */
  options: Choice[]
  /** Its dotted path. */
  path: string
  /** As in an equation; may be empty. */
  symbol: string
  /** SI unit as printed; empty for a pure number and for a choice. */
  unit: string
  /** The number; `null` for a choice. A flag is 0 or 1. */
  value: number | null
}
/** Which values make sense besides the range. */
export type ItemKind = "real"
  | "whole"
  | "flag"
  | "choice"
/** A number with its uncertainty, as printed. */
export type KeyEstimate = {
  /** Half of its 95 % interval, without the sign; empty where there is none. */
  half_width: string
  /** What it is. */
  name: string
  /** The unit of both, with its prefix. */
  unit: string
  /** The value; `unknown` where it is not known. */
  value: string
}
/** A number with its name. */
export type KeyNumber = {
  /** As in the summary. */
  name: string
  /** Its unit; `1` for a pure number. */
  unit: string
  /** SI. */
  value: number
}
/** A run among others over time. */
export type OverlaidRun = {
  /** Its course, in its own time. */
  course: Course
    | null
  /** Its number. */
  number: number
  /** What is added to its time [s]; `null` where it does not fit. */
  shift: number | null
  /** Why there is none. */
  trouble: string | null
}
/** A cycle that missed its deadline. */
export type LateCycle = {
  /** By how much [s]. */
  by: number
  /** Its number. */
  cycle: number
  /** Why, in a sentence. */
  sentence: string
}
/** A controller, a friction or a law that was loaded from a file. Times in seconds. */
export type LoadedStatus = {
  /** How long a call may take. */
  budget: number
  /** How long a call took: median, 99th and 99.9th percentile, longest. */
  call: [number, number, number, number]
  /** How often it was called. */
  calls: number
  /** Whether it has failed: it gives no torque until it is opened again. */
  failed: boolean
  /** Its file. */
  file: string
  /** SHA-256 of what was opened, in hexadecimal digits. */
  hash: string
  /** What it is: `C library`, `FMU 2.0`. */
  kind: string
  /** How many torques were not there when they were due: the last one was held meanwhile. */
  late: number
  /** What it calls itself. */
  name: string
  /** How many took longer. */
  over_budget: number
  /** From its question until its answer was there, likewise, where it runs in a process of its own. */
  response: [number, number, number, number] | null
  /** What it is in the loop: `controller`, `friction`, `law`. */
  role: string
  /** The parameter that says whether it is in the loop. */
  selector: string
}
/** Presliding loop of slow motion back and forth from rest: the bristles without damping. */
export type Loop = {
  /** Way from the start [rad]. */
  angle: number[]
  /** Friction torque [N m]. */
  torque: number[]
}
/** A loop about one operating point. */
export type LoopAt = {
  /** Its magnitude [dB]. */
  decibels: number[]
  /** The angle after a load torque of 0.1 N m [mrad]; empty where the loop is not stable. */
  disturbed: number[]
  /** Frequencies of the loop gain, rising [Hz]. */
  frequency: number[]
  /** Its imaginary part. */
  imaginary: number[]
  /** `sliding` or `stuck`. */
  load: string
  /** Its margins. */
  marks: LoopMark[]
  /** What it is worth: the numbers of `stickslip loop`. */
  numbers: LoopNumber[]
  /** Its phase, without jumps [°]. */
  phase: number[]
  /** Poles of the axis alone. */
  plant: LoopPole[]
  /** Poles of the closed loop, the slowest first. */
  poles: LoopPole[]
  /** Its real part. */
  real: number[]
  /** The angle after a set-point of 1 rad [rad]; empty where the loop is not stable. */
  setpoint: number[]
  /** Whether it is stable. */
  stable: boolean
  /** Instants of the steps [s]. */
  time: number[]
}
/** A position controller that is being designed. */
export type LoopDraft = {
  /** A hand on the wanted pair of poles. */
  drag?: PoleDrag
    | null
  /** The controller as the other kind that it is, or that kind's defaults. */
  kind?: DraftKind
    | null
  /** Speed at which the load slides [rad/s]; 10 where it is not given. */
  speed?: number | null
  /** Whether the corners of what may be wrong with the machine are judged as well: several times the time. */
  thorough?: boolean
  /** What is not as in force: value by path, as in `set`. */
  values?: Record<string, string>
}
/** What a fair tuning keeps to. */
export type LoopLimits = {
  /** The circle that a loop gain within the first of them stays out of. */
  circle: [number, number][]
  /** The same in each corner. */
  corner: number
  /** Noise of the commanded torque [N m RMS]. */
  noise_torque: number
  /** Peak of the sensitivity, sliding and stuck. */
  sensitivity: number
}
/** A margin, where it is on the loop gain. */
export type LoopMark = {
  /** [dB]. */
  decibels: number
  /** [Hz]. */
  frequency: number
  /** Imaginary part. */
  imaginary: number
  /** Which: `gain margin`, `phase margin`, `M_s`. */
  name: string
  /** [°]. */
  phase: number
  /** Real part of the loop gain. */
  real: number
  /** The same beside a point of a picture: `GM 3.9`. */
  short: string
  /** It in words. */
  text: string
}
/** A number of a loop. */
export type LoopNumber = {
  /** As in `summary.json`, behind `loop.sliding.`. */
  key: string
  /** In words. */
  name: string
  /** SI unit. */
  unit: string
  /** `null` where nothing limits it, and where the loop is not stable. */
  value: number | null
}
/** A pole in continuous time, ln z/T. */
export type LoopPole = {
  /** Damping ratio; 1 on the real axis, negative where it grows. */
  damping: number
  /** Natural frequency [rad/s]. */
  frequency: number
  /** [rad/s]. */
  imaginary: number
  /** [1/s]; below 0 it dies out. */
  real: number
}
/** A position controller on the machine as believed. */
export type LoopView = {
  /** The pair of poles that can be dragged; `null` where the poles follow from gains. */
  grip: PoleGrip
    | null
  /** The fields of the controller. */
  items: Item[]
  /** Its kind, as in a file. */
  kind: string
  /** What a fair tuning keeps to. */
  limits: LoopLimits
  /** The load sliding, then stuck. */
  loads: LoopAt[]
  /** Directions in which poles of one damping lie. */
  rays: DampingRay[]
  /** So far the plane of the poles is worth looking at [1/s]. */
  reach: number
  /** What is not as in force: value by path, as for `set`. */
  values: Record<string, string>
  /** Whether it keeps what a fair tuning asks for; `null` unless it was asked thoroughly. */
  verdict: LoopVerdict
    | null
}
/** Whether a loop keeps what a fair tuning asks for. */
export type LoopVerdict = {
  /** It does. */
  fair: boolean
  /** Why, in sentences. */
  sentences: string[]
  /** The worst of the machines that are off. */
  worst: CornerView
}
/** Something that was lost. */
export type Loss = {
  /** Why. */
  cause: string
  /** Cycles. */
  count: number
  /** The first cycle behind it. */
  cycle: number
  /** What to do. */
  remedy: string
}
/** What is believed of the machine, for a picture of it. */
export type Machine = {
  /** Units of the angle, with what an angle in rad is multiplied by. */
  angles: Factor[]
  /** Ends of the travel by the screw's angle [rad]. */
  ends: [number, number]
  /** The parts, from the drive motor on. */
  parts: Part[]
  /** Units of the velocity, with what a velocity in rad/s is multiplied by. */
  speeds: Factor[]
}
/** Something that happened in a cycle. */
export type Mark = {
  /** In which; where it is no cycle's own doing, in the newest at that time. */
  cycle: number
  /** What kind of thing. */
  kind: MarkKind
  /** In words. */
  text: string
}
/** What kind of thing happened. */
export type MarkKind = "fault"
  | "change"
  | "begin"
  | "end"
/** A measurement of breakaway or presliding, done or being done. */
export type BreakawayMeasurement = {
  /** The figures: that of the measurement first, then what earlier runs add. */
  figures: Picture[]
  /** What was found. */
  keys: KeyEstimate[]
  /** Whether it is being measured. */
  measuring: boolean
  /** What a reader should know, each with a remedy. */
  notes: string[]
  /** The values that make it the own friction, by path, as for `set`. */
  own: Record<string, string>
  /** Number of the run; `null` while it is measured, and where there is none. */
  run: number | null
  /** The runs that measured the same, the newest first. */
  runs: number[]
}
/** A friction curve, measured or being measured. */
export type MeasuredCurve = {
  /** The noisy course, velocity [rad/s] and torque [N m] of each part; empty for an earlier run. */
  course: [number, number][]
  /** The Stribeck curve through the points. */
  fit: FittedCurve
    | null
  /** Whether it is being measured. */
  measuring: boolean
  /** Why there is no fit, and what does not count, each with a remedy. */
  notes: string[]
  /** The points that count. */
  points: MeasuredPoint[]
  /** Whether the load motor rendered meanwhile. */
  rendered: boolean
  /** Number of the run; `null` while it is measured, and where there is none. */
  run: number | null
}
/** A point of a friction curve. */
export type MeasuredPoint = {
  /** Half of its 95 % interval [N m]. */
  half_width: number
  /** Measured less fitted [N m]; `null` without a fit. */
  residual: number | null
  /** Torque, of the velocity's sign [N m]. */
  torque: number
  /** Velocity [rad/s]. */
  velocity: number
}
/** A part of the machine. */
export type Part = {
  /** What is most to be known of it. */
  about: string
  /** Where its parameters are. */
  group: string
  /** Which. */
  kind: PartKind
  /** Its name. */
  name: string
}
/** Which part of a machine something is. */
export type PartKind = "drive_motor"
  | "coupling"
  | "screw"
  | "wheel"
  | "load_motor"
  | "encoder"
/** A figure with what one sees in it. */
export type Picture = {
  /** The caption. */
  caption: string
  /** The figure. */
  figure: Figure
}
/** A plan of a measurement. */
export type PlanForm = {
  /** What it will do, in a few words. */
  about: string
  /** Bench time that it takes [s], homing not counted. */
  duration: number
  /** Its values. */
  items: Item[]
}
/** A window of a stream: all its samples lie between the least and the largest. */
export type Point = {
  /** Its first cycle. */
  from: number
  /** Of each signal the last. */
  last: (number | null)[]
  /** Of each signal the largest. */
  max: (number | null)[]
  /** Of each signal the least value; `null` where there is no number. */
  min: (number | null)[]
  /** Cycles that are in no point, since the point before: lost, or in points that nobody took in time. */
  missing: number
  /** Of each signal whether there is among them what is no number. */
  nan: boolean[]
  /** Its last cycle. */
  to: number
}
/** A hand on the pair of poles that is wanted of a state feedback. */
export type PoleDrag = {
  /** Where it is [rad/s]. */
  imaginary: number
  /** Where it is [1/s]. */
  real: number
}
/** The pair of poles that is wanted, to be dragged. */
export type PoleGrip = {
  /** Natural frequency [rad/s]. */
  bandwidth: number
  /** Damping ratio. */
  damping: number
  /** Where it lies [rad/s], from 0 on. */
  imaginary: number
  /** Where the upper one lies [1/s]. */
  real: number
}
/** What can be measured. */
export type Quantity = "friction"
  | "breakaway"
  | "presliding"
/** How much was recorded. */
export type Recorded = {
  /** Size of the file [bytes]. */
  bytes: number
  /** The first cycle of it. */
  from: number
  /** Length [s]. */
  length: number
  /** Cycles that are not in it. */
  lost: number
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
/** A friction as it was rendered, or is being measured. */
export type RenderedFriction = {
  /** Own and desired friction, desired and rendered friction, load torque, sweep through standstill: figures 12, 13 and 14 of the paper, and 14 from close by. */
  figures: Picture[]
  /** The numbers that one looks for first. */
  keys: KeyEstimate[]
  /** Whether it is being measured. */
  measuring: boolean
  /** Number of the run; `null` where there is none. */
  run: number | null
  /** What came out, in a sentence. */
  verdict: string
}
/** How far the replay of a run is, or what it found. */
export type ReplayProgress = {
  /** Whether it has ended. */
  ended: boolean
  /** The part that is done, 0 … 1. */
  fraction: number
  /** Whether the whole run was replayed and every bit is the same; `null` until then. */
  identical: boolean | null
  /** Number of the run. */
  run: number
  /** What was found, or why it ended. */
  sentence: string | null
}
/** What a series is: it looks the same in every figure. */
export type Role = "measured"
  | "fitted"
  | "desired"
  | "own"
  | "rendered"
  | "reference"
  | {
  trace: number
}
/** A run. */
export type Run = {
  /** When it began, RFC 3339, UTC. */
  begun: string
  /** The command line. */
  command: string
  /** The position controller under test. */
  controller: string
  /** Its friction curve in a few points: velocity [rad/s], torque [N m]. */
  curve: [number, number][]
  /** Time on the bench, or on the clock where there was no bench [s]. */
  duration: number | null
  /** Its files. */
  files: string[]
  /** Where it lies, from the project's folder on. */
  folder: string
  /** The number that one looks for first. */
  key: KeyNumber
    | null
  /** The command that made it: `demo`, `measure friction`; `recording`. */
  kind: string
  /** The rendering law. */
  law: string
  /** In words. */
  name: string
  /** What a person wrote. */
  note: string
  /** Counted through the project; no other run ever gets it. */
  number: number
  /** The preset, where its command names one. */
  preset: string
  /** The one of them that can be replayed. */
  record: string | null
  /** Whether its files are there. */
  state: State
  /** Tags, sorted. */
  tags: string[]
  /** Version of the program. */
  version: string
}
/** Values with a role and a name. What is not finite or absurd (beyond 1e15) is left out; a line has a gap there. */
export type Series = {
  /** A line that is dashed, whatever its role. */
  dashed?: boolean
  /** Its values. */
  data: Data
  /** Points that are larger. */
  large?: boolean
  /** As in a legend. */
  name: string
  /** What it means. */
  role: Role
}
/** A signal. */
export type Signal = {
  /** What it is. */
  help: string
  /** The same for people. */
  label: string
  /** Its name. */
  name: string
  /** The same as printed; empty for a pure number. */
  printed_unit: string
  /** As in an equation; may be empty. */
  symbol: string
  /** SI unit. */
  unit: string
  /** What each of its values is called, from 0 on; empty for what is measured. */
  values: string[]
}
/** A run, as it was and as it would have been. */
export type Simulated = {
  /** How many were simulated. */
  cycles: number
  /** Why it ended before the record did. */
  ended: string | null
  /** Time of the first cycle [s]. */
  from: number
  /** Time on the bench over the time that the simulation took. */
  speed: number
  /** Time of each part of a trace [s]. */
  time: number[]
  /** Time of the last that was simulated [s]. */
  to: number
  /** The signals that were asked for. */
  traces: Trace[]
}
/** Whether a run's files are there. */
export type State = "here"
  | "missing"
  | "replaced"
  | "deleted"
/** How the bench is. */
export type Status = {
  /** Screw angle [rad]. */
  angle: number
  /** Who asks the operator for his place. */
  asks: string | null
  /** Parameters that are not as they were when the run began. */
  changed: number
  /** How the clock is kept. */
  clock: ClockStatus
  /** Number of the newest cycle. */
  cycle: number
  /** What runs: nothing, a motion, a measurement. */
  doing: CurrentTask
    | null
  /** Torque of the drive motor [N m]. */
  drive_torque: number
  /** How what ran last has ended. */
  last: Ended
    | null
  /** What happened on the link to the machine, where there is one. */
  link?: Counts
    | null
  /** Torque of the load motor, against positive motion [N m]. */
  load_torque: number
  /** What was loaded from a file, where something was. */
  loaded?: LoadedStatus
    | null
  /** How many marks there have been since the start. */
  marks: number
  /** Why the run that ended last is not in the catalogue. */
  not_entered: string | null
  /** Who may change something. */
  operator: string | null
  /** How far the linings are pressed on, 0 … 1. */
  preload: number
  /** The preset it runs with. */
  preset: string
  /** Ticks in a second [Hz]. */
  rate: number
  /** Why, where it is a fault or has ended. */
  reason: string | null
  /** How much is in it, or was where it could not go on. */
  recorded: Recorded
    | null
  /** The file that the run is recorded into. */
  recording: string | null
  /** Whether there is something to redo. */
  redo: boolean
  /** Whether the load motor renders. */
  render: boolean
  /** `off`, `homing`, `ready`, `running`, `stopping`, `fault`, or `ended` once the loop does not run any more. */
  state: string
  /** Whether there is something to undo. */
  undo: boolean
  /** Estimated velocity [rad/s]. */
  velocity: number
  /** Where it is open to measurement and calibration tools. */
  xcp: XcpStatus[]
}
/** A speed range in which a limit is exceeded. */
export type SpeedRange = {
  /** Lower end [rad/s]. */
  from: number
  /** `current`, `voltage`, `slope`, `response`, `speed`. */
  limit: string
  /** Reason, in a sentence. */
  reason: string
  /** Upper end [rad/s]. */
  to: number
}
/** What runs, and since when. */
export type Target = {
  /** What it was built for: processor, system, and whether overflows are checked. */
  built: string
  /** What can be taken along, at `/implementation/FILE`. */
  files: TargetFile[]
  /** Where the machine is: `virtual`, or its address. */
  machine: string
  /** Ticks in a second [Hz]. */
  rate: number
  /** When it was started: seconds since 1970 [s]. */
  since: number
  /** Version of the program. */
  version: string
  /** What the real-time thread asked of the system. */
  wishes: SettingResult[]
}
/** A file of what runs. */
export type TargetFile = {
  /** What is in it. */
  about: string
  /** Its path. */
  file: string
  /** What it is called. */
  name: string
}
/** A bar of a histogram. */
export type TimeBin = {
  /** So many cycles. */
  count: number
  /** From [s]. */
  from: number
  /** Below [s]. */
  to: number
}
/** The time that a part takes. */
export type TimedPart = {
  /** All of them [s]. */
  longest: number
  /** Half of all cycles take at most this [s]. */
  median: number
  /** Which. */
  name: string
  /** 99.9 % of them [s]. */
  p999: number
}
/** How long cycles take. Times in seconds. */
export type Timing = {
  /** The whole cycle, from its wake-up to the end of its work. */
  bins: TimeBin[]
  /** Cycles that are counted. */
  cycles: number
  /** The last of them, the newest first. */
  late: LateCycle[]
  /** Cycles that were held because of them. */
  missed: number
  /** Deadlines that were missed, all of them. */
  overruns: number
  /** Lateness, the whole cycle, and its parts in their order. */
  parts: TimedPart[]
  /** From cycle to cycle: what a cycle may take. */
  period: number
}
/** How far a rendering law is from chatter. */
export type ChatterMargin = {
  /** Below this share caution is due. */
  caution: number
  /** Change of the load torque from millisecond to millisecond that is to be expected [N m RMS]. */
  chatter: number
  /** From which on it is chatter [N m RMS]. */
  chatter_limit: number
  /** Additional delay up to which it is [s]; `null`: any that was tried. */
  delay_margin: number | null
  /** Factor of the law's torque up to which the loop is stable; `null`: any that was tried. */
  gain_margin: number | null
  /** What of the way to the nearest limit is left, 0 … 1; `null` where it is not known. */
  left: number | null
  /** The nearest limit: `chatter`, `stiffness`. */
  nearest: string
  /** In a sentence: how far, or why not and what would do. */
  sentence: string
  /** Whether the bench would take it. */
  stable: boolean
  /** Stiffness of the desired bristles [N m/rad]; `null` where the law renders none. */
  stiffness: number | null
  /** Stiffness of the desired bristles up to which it does not chatter [N m/rad]; `null`: no limit was found, or it is not stable. */
  stiffness_limit: number | null
}
/** A signal, as it was and as it would have been. Of each part of the time the least and the largest value, so that no spike is lost. */
export type Trace = {
  /** Simulated less recorded. */
  difference: [(number | null)[], (number | null)[]]
  /** Its largest magnitude. */
  peak: number | null
  /** As recorded: least and largest. */
  recorded: [(number | null)[], (number | null)[]]
  /** The difference over all cycles, RMS; `null` where one of them is no number. */
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
/** How far a tuning is, or what it found. */
export type TuneProgress = {
  /** Who began it. */
  by: string
  /** Whether it has ended. */
  ended: boolean
  /** The part that is done, 0 … 1: of the longest search. */
  fraction: number
  /** Its number; 0 where there was none. */
  number: number
  /** What was found, or why nothing was. */
  sentence: string | null
  /** What is not as it was in force when it began: value by path; `null` until then, and where nothing was found. */
  values: Record<string, string> | null
}
/** A parameter or a result. */
export type Value = {
  /** Where it is one. */
  number: number | null
  /** Dotted. */
  path: string
  /** Whether it is a result; else a parameter. */
  result: boolean
  /** As in an equation; may be empty. */
  symbol: string
  /** As text. */
  text: string
  /** SI unit. */
  unit: string
}
/** What became of a wish. */
export type SettingResult = {
  /** What the refusal costs; empty where it was granted. */
  costs: string
  /** The command that mends it. */
  mend: string | null
  /** What the system said where it refused. */
  refused: string | null
  /** What was asked for. */
  wish: string
}
/** An address at which the bench speaks XCP. */
export type XcpStatus = {
  /** Its address. */
  address: string
  /** Rows that its measurements have lost since the start. */
  lost: number
  /** The address of the master that is connected. */
  master: string | null
  /** Whether it measures. */
  measuring: boolean
  /** `udp` or `tcp`. */
  transport: string
}
