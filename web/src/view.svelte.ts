// The current window and the open overlays. Each window has an address.

class View {
  path = $state(location.pathname)
  query = $state(location.search)
  palette = $state(false)
  keys = $state(false)
  log = $state(false)
  /** The parameter group open next to the window. */
  group = $state<{ name: string; path: string } | null>(null)

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
    if (this.palette) this.palette = false
    else if (this.keys) this.keys = false
    else if (this.log) this.log = false
    else if (this.group) this.group = null
    else return false
    return true
  }
}

export const view = new View()
export const go = (path: string) => view.go(path)
