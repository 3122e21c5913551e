// node read_bag.mjs BAG.mcap [RECORDING.jsonl]
// Reads a bag of ROS 2 with other people's code alone (@mcap/core for the container, @foxglove/rosmsg for the schemas that
// it carries, @foxglove/rosmsg2-serialization for the messages). Each schema must have the fields of the published
// definition (@foxglove/rosmsg-msgs-common: Jazzy, where it has the type), and each message must decode alike by both.
// With the second file, what `dds_recorder convert` wrote of the recording that the bag was made of, each message must have
// the values that were recorded, and none may be missing.
import {open} from 'node:fs/promises';
import {createInterface} from 'node:readline';
import {createReadStream} from 'node:fs';
import {createRequire} from 'node:module';
import path from 'node:path';

const require = createRequire(path.join(process.env.READERS ?? process.cwd(), 'package.json'));
const {McapIndexedReader} = require('@mcap/core');
const {parse} = require('@foxglove/rosmsg');
const {MessageReader} = require('@foxglove/rosmsg2-serialization');
const {ros2jazzy} = require('@foxglove/rosmsg-msgs-common');
const {decompress} = require('fzstd');

const [bagPath, jsonPath] = process.argv.slice(2);

function fail(text) {
  console.error(`read_bag: ${text}`);
  process.exit(1);
}

function same(a, b, place) {
  const [x, y] = [JSON.stringify(a, plain), JSON.stringify(b, plain)];
  if (x !== y) fail(`${place}: ${x?.slice(0, 400)} against ${y?.slice(0, 400)}`);
}
const plain = (_key, value) =>
  typeof value === 'bigint' || (typeof value === 'number' && !Number.isFinite(value))
    ? String(value)
    : ArrayBuffer.isView(value)
      ? Array.from(value)
      : value;

// "sensor_msgs/msg/JointState" is "sensor_msgs/JointState" in definitions.
const short = name => name.replace('/msg/', '/');
const fieldsOf = definition =>
  definition.definitions
    .filter(field => !field.isConstant)
    .map(({name, type, isArray, arrayLength}) => ({name, type: short(type), isArray: isArray === true, arrayLength}));

// The published definition of a type with all that it is made of, the type first; null: it has none.
function published(name) {
  if (!(name in ros2jazzy)) return null;
  const all = new Map([[name, ros2jazzy[name]]]);
  for (const definition of all.values())
    for (const field of definition.definitions)
      if (field.isComplex && short(field.type) in ros2jazzy) all.set(short(field.type), ros2jazzy[short(field.type)]);
  return [...all.values()];
}

const compared = {messages: 0, published: 0, recorded: 0};
const hashes = {},
  types = {},
  counts = {};

async function decoded() {
  const file = await open(bagPath);
  const readable = {
    size: async () => BigInt((await file.stat()).size),
    read: async (offset, length) => {
      const bytes = new Uint8Array(Number(length));
      const {bytesRead} = await file.read(bytes, 0, bytes.length, Number(offset));
      if (bytesRead !== bytes.length) fail('the file ends early');
      return bytes;
    },
  };
  const decompressHandlers = {zstd: (bytes, size) => decompress(bytes, new Uint8Array(Number(size)))};
  const reader = await McapIndexedReader.Initialize({readable, decompressHandlers});
  if (reader.header.profile !== 'ros2') fail(`the profile is ${reader.header.profile}`);
  const decoders = new Map();
  for (const channel of reader.channelsById.values()) {
    const schema = reader.schemasById.get(channel.schemaId);
    if (channel.messageEncoding !== 'cdr' || schema.encoding !== 'ros2msg')
      fail(`${channel.topic}: ${channel.messageEncoding}, ${schema.encoding}`);
    if (!/^RIHS01_[0-9a-f]{64}$/.test(channel.metadata.get('topic_type_hash')))
      fail(`${channel.topic}: no hash of the type`);
    const qos = channel.metadata
      .get('offered_qos_profiles')
      .split('\n')
      .map(line => line.trim().replace('- ', ''));
    for (const policy of ['history', 'depth', 'reliability', 'durability', 'liveliness'])
      if (!qos.some(line => new RegExp(`^${policy}: \\d+$`).test(line)))
        fail(`${channel.topic}: ${policy} of the QoS: ${qos}`);
    const definitions = parse(new TextDecoder().decode(schema.data), {ros2: true});
    const theirs = published(short(schema.name));
    for (const definition of theirs ?? []) {
      const ours = definition === theirs[0] ? definitions[0] : definitions.find(one => one.name === definition.name);
      if (!ours) fail(`${schema.name}: ${definition.name} is missing in the schema`);
      same(fieldsOf(ours), fieldsOf(definition), `${schema.name}: ${definition.name}`);
    }
    decoders.set(channel.id, [
      new MessageReader(definitions),
      theirs && new MessageReader([{definitions: theirs[0].definitions}, ...theirs.slice(1)]),
    ]);
    hashes[schema.name] = channel.metadata.get('topic_type_hash');
    types[channel.topic] = schema.name;
  }
  const messages = [];
  for await (const message of reader.readMessages()) {
    const {topic} = reader.channelsById.get(message.channelId);
    const [byOurs, byTheirs] = decoders.get(message.channelId);
    const value = byOurs.readMessage(message.data);
    if (byTheirs) (same(byTheirs.readMessage(message.data), value, topic), compared.published++);
    messages.push({topic, value, time: message.logTime, sent: message.publishTime});
    counts[topic] = (counts[topic] ?? 0) + 1;
    compared.messages++;
  }
  if (BigInt(messages.length) !== reader.statistics.messageCount) fail('the statistics count otherwise');
  await file.close();
  return messages;
}

// Integers beyond 2^53 as text: exact.
const parseExactly = line => JSON.parse(line.replace(/([:[,])(-?\d{16,})(?=[,}\]])/g, '$1"$2"'));
const number = value => (typeof value === 'string' ? Number(value) : value);

async function holdAgainst(messages) {
  const byTopic = new Map();
  for (const message of messages) byTopic.set(message.topic, [...(byTopic.get(message.topic) ?? []), message]);
  const next = (topic, ours) => {
    const message =
      byTopic.get(topic)?.shift() ?? fail(`${topic}: a message is missing for ${ours.topic} at ${ours.log_time_ns}`);
    same(String(message.time), String(ours.log_time_ns), `${topic}: log time`);
    same(String(message.sent), String(ours.publish_time_ns), `${topic}: time of sending`);
    compared.recorded++;
    return message.value;
  };
  const stamped = (value, ours) =>
    same(
      String(
        BigInt(value.header.stamp.sec) * 1000000000n + BigInt(value.header.stamp.nanosec ?? value.header.stamp.nsec),
      ),
      String(ours.publish_time_ns),
      'stamp',
    );
  const joints = (topic, ours, effort) => {
    const value = next(topic, ours),
      n = ours.sample.joint_count;
    stamped(value, ours);
    same(value.name.length, n, `${topic}: names`);
    same(value.position, ours.sample.position_rad.slice(0, n), `${topic}: position`);
    same(value.velocity, ours.sample.velocity_rad_s.slice(0, n), `${topic}: velocity`);
    same(value.effort, effort.slice(0, n), `${topic}: effort`);
  };
  const wrench = (topic, ours) => {
    const value = next(topic, ours);
    stamped(value, ours);
    same(value.header.frame_id, 'phantom/at_tool', `${topic}: frame`);
    for (const vector of [value.wrench.force, value.wrench.torque])
      for (const number of [vector.x, vector.y, vector.z]) if (!Number.isFinite(number)) fail(`${topic}: no number`);
  };
  let poseIsKnown = false;
  for await (const line of createInterface({input: createReadStream(jsonPath)})) {
    const ours = parseExactly(line),
      sample = ours.sample;
    if (ours.topic === 'slave_state') {
      joints('/phantom/joint_states', ours, sample.loop_torque_Nm);
      poseIsKnown = true;
      for (const {transform, header} of next('/tf', ours).transforms) {
        const {x, y, z, w} = transform.rotation;
        if (Math.abs(x * x + y * y + z * z + w * w - 1) > 1e-9) fail('/tf: no rotation');
        stamped({header}, ours);
      }
    } else if (ours.topic === 'master_state') {
      joints('/phantom/master/joint_states', ours, sample.percept_torque_Nm);
      wrench('/phantom/percept/torque_wrench', ours);
    } else if (ours.topic === 'percept') {
      same(next('/phantom/percept/closeness', ours).data, sample.valid ? number(sample.closeness) : NaN, 'closeness');
      same(next('/phantom/percept/speed', ours).data, sample.valid ? number(sample.speed_m_s) : NaN, 'speed');
      if (sample.valid)
        same(next('/phantom/percept/drag', ours).effort, sample.drag_torque_Nm.slice(0, sample.joint_count), 'drag');
      if (sample.valid && poseIsKnown) wrench('/phantom/percept/drag_wrench', ours);
      const marker = next('/phantom/percept/worst_place', ours);
      same(marker.pose.position, sample.position_m, 'worst place');
      same(marker.action, sample.valid && sample.object !== 0 ? 0 : 2, 'worst place: action');
      if (Math.abs(marker.color.r - sample.closeness) > 1e-6) fail('worst place: colour');
    }
  }
  const always = new Set(['/tf_static', '/phantom/robot_description', '/diagnostics']);
  for (const [topic, left] of byTopic)
    if (left.length > 0 && !always.has(topic)) fail(`${topic}: ${left.length} messages that were not recorded`);
}

const messages = await decoded();
if (jsonPath) await holdAgainst(messages);
const last = Object.fromEntries(messages.map(({topic, value}) => [topic, value]));
console.log(
  JSON.stringify(
    {
      ...compared,
      types,
      hashes,
      counts,
      last: {diagnostics: last['/diagnostics'], description: last['/phantom/robot_description']},
    },
    plain,
  ),
);
