// SPDX-License-Identifier: Apache-2.0
// A data set as the server describes it, for tests.
import type { DatasetInfo } from '../src/api';

export const datasetInfo = (id: string, more: Partial<DatasetInfo> = {}): DatasetInfo => ({
  id,
  title: id,
  dims: [2, 2, 2],
  spacing: [1, 1, 1],
  diagonal: 3,
  worldUnit: '',
  channels: [{ name: 'a' }],
  times: { count: 1, values: [], unit: '' },
  state: 'stored',
  memoryBytes: 8,
  level: 0,
  levels: [{ dims: [2, 2, 2] }],
  ...more,
});
