// SPDX-License-Identifier: Apache-2.0
// Describes the fields of the scene's JSON Schema in the form from which controls are built: a field added to
// the schema gets its control without a change here.
import document from '../../protocol/schema.json';
import { isNamedList, type Capabilities, type Named } from './api';

export type Path = readonly (string | number)[];

interface SchemaNode {
  $ref?: string;
  type?: string | string[];
  title?: string;
  description?: string;
  properties?: Record<string, SchemaNode>;
  items?: SchemaNode;
  minItems?: number;
  maxItems?: number;
  minimum?: number;
  maximum?: number;
  exclusiveMinimum?: number;
  exclusiveMaximum?: number;
  pattern?: string;
  enum?: unknown[];
  anyOf?: SchemaNode[];
  oneOf?: SchemaNode[];
  default?: unknown;
}

export type Kind =
  | 'number'
  | 'integer'
  | 'toggle'
  | 'enum'
  | 'color'
  | 'text'
  | 'vector'
  | 'channels'
  | 'regions'
  | 'list'
  | 'object'
  | 'other';

/** Number of regions of a volume that two planes along every axis divide. */
export const kRegions = 27;

export interface Field {
  /** The key, or '' for the whole scene. */
  key: string;
  /** The key in words: "orthoHeight" is "Ortho height". */
  label: string;
  kind: Kind;
  /** What the field means, with its unit. */
  doc: string;
  /** "degrees"; empty for plain numbers. */
  unit: string;
  /** Bounds, and whether the bound itself is allowed. */
  minimum?: number;
  maximum?: number;
  aboveMinimum: boolean;
  /** Whether null lets the server choose the value. */
  automatic: boolean;
  default?: unknown;
  /** Number of components of a vector. */
  length: number;
  options: string[];
  /** Keys of an object. */
  members: string[];
  /** How many items a list may have, and what one of them is called: "Light". */
  maxItems: number;
  itemLabel: string;
}

const root = document as unknown as SchemaNode;

function resolve(node: SchemaNode): SchemaNode {
  if (!node.$ref) return node;
  const target = node.$ref
    .replace(/^#\//, '')
    .split('/')
    .reduce<Record<string, unknown>>((at, key) => at[key] as Record<string, unknown>, root as Record<string, unknown>);
  return { ...resolve(target as SchemaNode), ...node, $ref: undefined };
}

/** The node without its null alternative, and whether it had one. */
function withoutNull(outer: SchemaNode): { node: SchemaNode; automatic: boolean } {
  const node = resolve(outer);
  const { anyOf, oneOf, ...rest } = node;
  const choices = anyOf ?? oneOf;
  if (!choices) {
    const nullable = Array.isArray(node.type) ? node.type.includes('null') : (node.enum?.includes(null) ?? false);
    return { node, automatic: nullable };
  }
  const real = choices.map(resolve).filter((choice) => choice.type !== 'null');
  const automatic = real.length < choices.length;
  return { node: real.length === 1 ? { ...resolve(real[0]!), ...rest } : { ...node }, automatic };
}

function kindOf(node: SchemaNode): Kind {
  const types = [node.type ?? []].flat().filter((type) => type !== 'null');
  if (node.enum) return 'enum';
  if (types.length !== 1) return 'other';
  switch (types[0]) {
    case 'boolean':
      return 'toggle';
    case 'integer':
    case 'number':
      return types[0];
    case 'string':
      return node.pattern?.startsWith('^#') ? 'color' : 'text';
    case 'object':
      return 'object';
    case 'array':
      return kindOfList(node);
    default:
      return 'other';
  }
}

function kindOfList(node: SchemaNode): Kind {
  const items = node.items ? kindOf(resolve(node.items)) : 'other';
  if (items === 'object') return 'list';
  const fixed = node.minItems === node.maxItems;
  if (items === 'integer' && !fixed) return 'channels';
  if (items === 'toggle' && node.minItems === kRegions) return 'regions';
  return items === 'number' && fixed ? 'vector' : 'other';
}

const inWords = (key: string) => {
  const words = key.replace(/([a-z])([A-Z])/g, (_, a: string, b: string) => `${a} ${b.toLowerCase()}`);
  return words.charAt(0).toUpperCase() + words.slice(1);
};

const itemLabelOf = (list: SchemaNode) => inWords((list.items && resolve(list.items).title) ?? 'Item');

function describeNode(key: string, outer: SchemaNode): Field {
  const { node, automatic } = withoutNull(outer);
  const doc = (node.description ?? '').split('\n')[0]!; // the lines below describe the choices
  return {
    key,
    label: inWords(key),
    kind: kindOf(node),
    doc,
    unit: doc.match(/ Unit: ([^.]+)\.$/)?.[1] ?? '',
    minimum: node.minimum ?? node.exclusiveMinimum,
    maximum: node.maximum ?? node.exclusiveMaximum,
    aboveMinimum: node.exclusiveMinimum !== undefined,
    automatic: automatic && node.default == null,
    default: node.default ?? undefined,
    length: node.minItems ?? 0,
    options: (node.enum ?? []).filter((entry): entry is string => typeof entry === 'string'),
    members: Object.keys(node.properties ?? {}),
    maxItems: node.maxItems ?? Infinity,
    itemLabel: itemLabelOf(node),
  };
}

/** The field at a path of the scene; numbers step into lists. Throws for a path the schema does not know. */
export function fieldAt(path: Path): Field {
  let node = root;
  for (const key of path) {
    const inner = withoutNull(node).node;
    const next = typeof key === 'number' ? inner.items : inner.properties?.[key];
    if (!next) throw new Error(`the schema has no ${path.join('.')}`);
    node = next;
  }
  return describeNode(String(path[path.length - 1] ?? ''), node);
}

/** Paths of the single values below a path. Objects are expanded; a list of objects counts as one value. */
export function leavesBelow(path: Path): Path[] {
  const field = fieldAt(path);
  if (field.kind === 'object') return field.members.flatMap((member) => leavesBelow([...path, member]));
  return field.kind === 'other' ? [] : [path];
}

/**
 * The choices of an enumerated field, each with a line of text if known: the list in the server's capabilities that
 * shares most names with the schema or, if none has half of them, the schema's names alone.
 */
export function choicesOf(path: Path, capabilities: Capabilities): Named[] {
  const { options } = fieldAt(path);
  const shared = (list: Named[]) => list.filter(({ name }) => options.includes(name)).length;
  const [best] = Object.values(capabilities)
    .filter(isNamedList)
    .sort((a, b) => shared(b) - shared(a));
  return best && shared(best) >= options.length / 2 ? best : options.map((name) => ({ name }));
}

/** A JSON pointer in words: "/channels/0/gamma" is "Channel 1, gamma". */
export function sayPointer(pointer: string): string {
  const words: string[] = [];
  let node: SchemaNode | undefined = root;
  for (const key of pointer.split('/').filter(Boolean)) {
    const inner: SchemaNode = node ? withoutNull(node).node : {};
    const isItem = kindOf(inner) === 'list' && /^\d+$/.test(key);
    if (isItem) words[words.length - 1] = `${itemLabelOf(inner)} ${Number(key) + 1}`;
    else words.push(key);
    node = isItem ? inner.items : inner.properties?.[key];
  }
  return words.join(', ');
}
