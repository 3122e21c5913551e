// node read_recording.mjs FILE.mcap [FILE.jsonl]
// Reads a recording with other people's code alone (@mcap/core for the container, @foxglove/omgidl-* for the samples, by
// the schemas that the file itself carries) and, with the second file, holds every sample against what `dds_recorder
// convert` wrote of it.
import {open, readFile} from 'node:fs/promises';
import {createInterface} from 'node:readline';
import {createReadStream} from 'node:fs';
import {createRequire} from 'node:module';
import path from 'node:path';

const require = createRequire(path.join(process.env.READERS ?? process.cwd(), 'package.json'));
const {McapIndexedReader, McapStreamReader} = require('@mcap/core');
const {parseIDL} = require('@foxglove/omgidl-parser');
const {MessageReader} = require('@foxglove/omgidl-serialization');
const {decompress} = require('fzstd');

const [mcapPath, jsonPath] = process.argv.slice(2);
const decompressHandlers = {zstd: (bytes, size) => decompress(bytes, new Uint8Array(Number(size)))};

function fail(text) {
  console.error(`read_recording: ${text}`);
  process.exit(1);
}

// Integers beyond 2^53 as text, on both sides: exact.
const parseExactly = line => JSON.parse(line.replace(/([:[,])(-?\d{16,})(?=[,}\]])/g, '$1"$2"'));
const isNumber = text => /^(-?\d+|NaN|-?Infinity)$/.test(text);
const hexadecimal = octets => octets.map(octet => octet.toString(16).padStart(2, '0')).join('');

// Samples as JSON has them; octets as an array.
function plain(value) {
  if (typeof value === 'bigint') return Number.isSafeInteger(Number(value)) ? Number(value) : value.toString();
  if (ArrayBuffer.isView(value)) return Array.from(value, plain);
  if (Array.isArray(value)) return value.map(plain);
  if (value !== null && typeof value === 'object')
    return Object.fromEntries(Object.entries(value).map(([key, member]) => [key, plain(member)]));
  return value;
}

const known = value => typeof value === 'number' || typeof value === 'boolean' || typeof value === 'string';

// Fields that both have must agree; enumerators may be told by name on one side and by number on the other.
function compare(theirs, ours, place) {
  if (Array.isArray(ours)) {
    if (!Array.isArray(theirs) || theirs.length !== ours.length) fail(`${place}: lengths differ`);
    ours.forEach((member, i) => compare(theirs[i], member, `${place}[${i}]`));
  } else if (ours !== null && typeof ours === 'object') {
    for (const [key, member] of Object.entries(ours)) {
      if (!(key in theirs)) fail(`${place}.${key}: the other reader does not have it`);
      compare(theirs[key], member, `${place}.${key}`);
    }
  } else if (typeof ours === 'number' && typeof theirs === 'number') {
    const same = theirs === ours || Math.abs(theirs - ours) <= 1e-6 * Math.abs(theirs);
    if (!same) fail(`${place}: ${theirs} against ${ours}`);
    compared.numbers++;
  } else if (typeof ours === 'string' && typeof theirs === 'number' && !isNumber(ours)) {
    compared.enumerators++;
  } else if (typeof ours === 'string' && Array.isArray(theirs)) {
    if (hexadecimal(theirs) !== ours) fail(`${place}: other octets`);
    compared.octets += theirs.length;
  } else if (known(ours) && String(theirs) !== String(ours)) {
    fail(`${place}: ${theirs} against ${ours}`);
  }
}

const compared = {samples: 0, numbers: 0, enumerators: 0, octets: 0};

async function indexed() {
  const file = await open(mcapPath);
  const readable = {
    size: async () => BigInt((await file.stat()).size),
    read: async (offset, length) => {
      const bytes = new Uint8Array(Number(length));
      const {bytesRead} = await file.read(bytes, 0, bytes.length, Number(offset));
      if (bytesRead !== bytes.length) fail('the file ends early');
      return bytes;
    },
  };
  const reader = await McapIndexedReader.Initialize({readable, decompressHandlers});
  const readers = new Map();
  const messages = [];
  for await (const message of reader.readMessages()) {
    const channel = reader.channelsById.get(message.channelId);
    const schema = reader.schemasById.get(channel.schemaId);
    if (channel.messageEncoding !== 'cdr') fail(`${channel.topic}: encoding ${channel.messageEncoding}`);
    if (schema.encoding !== 'omgidl') fail(`${channel.topic}: schema encoding ${schema.encoding}`);
    if (!readers.has(schema.id)) {
      const definitions = parseIDL(new TextDecoder().decode(schema.data));
      readers.set(schema.id, new MessageReader(schema.name, definitions));
    }
    messages.push({message, topic: channel.topic, sample: plain(readers.get(schema.id).readMessage(message.data))});
  }
  if (BigInt(messages.length) !== reader.statistics.messageCount) fail('the statistics count otherwise');
  let metadata = 0;
  for await (const record of reader.readMetadata()) metadata += record.name.startsWith('phantom.') ? 1 : 0;
  if (metadata < 2) fail("the recording's metadata are not found");
  let attachments = 0;
  for await (const record of reader.readAttachments()) attachments += record.data.length > 0 ? 1 : 0;
  await file.close();
  return {messages, metadata, attachments};
}

async function streamed() {
  const reader = new McapStreamReader({decompressHandlers, validateCrcs: true});
  reader.append(await readFile(mcapPath));
  let count = 0;
  for (let record; (record = reader.nextRecord());) count += record.type === 'Message' ? 1 : 0;
  if (!reader.done()) fail('the stream reader does not find the end');
  return count;
}

const {messages, metadata, attachments} = await indexed();
if ((await streamed()) !== messages.length) fail('the two readers find different numbers of samples');
async function holdAgainst(jsonFile) {
  let i = 0;
  for await (const line of createInterface({input: createReadStream(jsonFile)})) {
    const ours = parseExactly(line);
    const theirs = messages[i++] ?? fail(`only ${messages.length} samples, the recorder has more`);
    if (theirs.topic !== ours.topic || String(theirs.message.logTime) !== String(ours.log_time_ns))
      fail(`sample ${i}: ${theirs.topic} at ${theirs.message.logTime} against ${ours.topic} at ${ours.log_time_ns}`);
    if (!('sample' in ours))
      fail(`sample ${i} (${ours.topic}): the recorder could not decode it: ${line.slice(0, 200)}`);
    compare(theirs.sample, ours.sample, ours.topic);
    compared.samples++;
  }
  if (i !== messages.length) fail(`${messages.length} samples, the recorder has only ${i}`);
}

if (jsonPath) await holdAgainst(jsonPath);
console.log(
  JSON.stringify({
    messages: messages.length,
    ...compared,
    metadata,
    attachments,
    topics: [...new Set(messages.map(m => m.topic))].sort(),
  }),
);
