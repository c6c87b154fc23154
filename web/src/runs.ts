// Requests for earlier runs.

import { bench } from './bench.svelte'
import { Refused } from './connection'
import type { CurveName, BreakawayMeasurement, MeasuredCurve, Quantity, RenderedFriction } from './protocol'

export async function curves(): Promise<CurveName[]> {
  try {
    return (await bench.connection.call({ call: 'curves' }, 'curves')).curves
  } catch (error) {
    if (error instanceof Refused) return []
    throw error
  }
}

export async function curve(run: number | null): Promise<MeasuredCurve | null> {
  try {
    return await bench.connection.call({ call: 'curve', run }, 'curve')
  } catch (error) {
    if (error instanceof Refused) return null
    throw error
  }
}

/** The newest curve with rendered friction, complete or growing. */
export async function rendered(): Promise<RenderedFriction | null> {
  try {
    return await bench.connection.call({ call: 'rendered' }, 'rendered')
  } catch (error) {
    if (error instanceof Refused) return null
    throw error
  }
}

/** Result at rest of a run or of the running measurement, by default the newest. */
export async function atRest(what: Quantity, run: number | null): Promise<BreakawayMeasurement | null> {
  try {
    return await bench.connection.call({ call: 'at_rest', what, run }, 'at_rest')
  } catch (error) {
    if (error instanceof Refused) return null
    throw error
  }
}
