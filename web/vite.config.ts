import { svelte } from '@sveltejs/vite-plugin-svelte'
import { defineConfig } from 'vite'
import { guide } from './guide'

// `npm run dev` against a running bench: STICKSLIP_BENCH=http://127.0.0.1:9740, with its token in the printed address.
const bench = process.env.STICKSLIP_BENCH ?? 'http://127.0.0.1:9740'

export default defineConfig({
  plugins: [svelte(), guide()],
  build: {
    outDir: process.env.STICKSLIP_PAGE_OUT ?? 'dist',
    emptyOutDir: true,
    target: 'es2022',
    assetsInlineLimit: 0,
    modulePreload: { polyfill: false },
    reportCompressedSize: false,
  },
  server: { proxy: { '/api': { target: bench, ws: true } } },
})
