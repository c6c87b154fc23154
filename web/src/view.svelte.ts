// The current window and the open overlays. Each window has an address.

class View {
  path = $state(location.pathname)
  query = $state(location.search)
  palette = $state(false)
  keys = $state(false)
  log = $state(false)
  changes = $state(false)
  settings = $state(false)
  sets = $state(false)
  /** The dialog that ends the program. */
  ending = $state(false)
  /** The parameter group open next to the window. */
  group = $state<{ name: string; path: string } | null>(null)
  /** How to close the open overlays, the topmost last. */
  #overlays: (() => void)[] = []

  constructor() {
    addEventListener('popstate', () => this.#read())
  }

  #read() {
    this.path = location.pathname
    this.query = location.search
  }

  go(path: string) {
    if (path !== location.pathname + location.search) history.pushState(null, '', path)
    this.#read()
    this.group = null
  }

  /** Closes the topmost overlay; returns whether one was open. */
  close(): boolean {
    const close = this.#overlays.at(-1)
    close?.()
    return close !== undefined
  }

  /** Adds an overlay and returns how to remove it. */
  open(close: () => void): () => void {
    // A function of its own, so that one callback can close two overlays.
    const entry = () => close()
    this.#overlays.push(entry)
    return () => (this.#overlays = this.#overlays.filter((one) => one !== entry))
  }
}

export const view = new View()
export const go = (path: string) => view.go(path)
/** Attached to a popup, menu or dialog: Esc closes it while it is displayed. */
export const overlay = (close: () => void) => () => view.open(close)
