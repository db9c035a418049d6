// SPDX-License-Identifier: Apache-2.0
// Preact with signals: a 6 KB, well maintained library. With signals, a number in the status bar can change thirty
// times a second without rendering the panels around it again.
import { defineConfig } from 'vitest/config';

export default defineConfig({
  base: './', // every address is relative: the page works behind a path prefix and an SSH tunnel
  esbuild: { jsx: 'automatic', jsxImportSource: 'preact' },
  build: { target: 'es2022', assetsInlineLimit: 0, chunkSizeWarningLimit: 200 },
  server: { fs: { allow: ['..'] } },
  test: { include: ['test/**/*.test.ts'] },
});
