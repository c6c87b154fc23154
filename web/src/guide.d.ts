declare module 'virtual:guide' {
  export const pages: import('../guide').Page[]
}
