#include "tests/ros2/foreign_node.hpp"

#include <algorithm>
#include <chrono>
#include <cstring>
#include <stdexcept>

#include "ros2_robot.h"
#include "tests/ros2/ros2_types.h"

namespace phantom::ros2::test {
namespace {

// Loopback alone; peers by address, so that it depends on no multicast.
constexpr const char* kConfiguration =
    "<CycloneDDS><Domain id='any'><General><Interfaces><NetworkInterface address='127.0.0.1' "
    "multicast='false'/></Interfaces><AllowMulticast>false</AllowMulticast></General><Discovery>"
    "<ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>30</MaxAutoParticipantIndex><Peers>"
    "<Peer address='127.0.0.1'/></Peers></Discovery></Domain></CycloneDDS>";

std::int32_t made(std::int32_t entity, const char* what) {
  if (entity < 0)
    throw std::runtime_error(std::string("Cyclone DDS: ") + what + ": " + dds_strretcode(-entity));
  return entity;
}

// The QoS of rmw/qos_profiles.h.
dds_qos_t* ros_qos(bool latched, int depth) {
  dds_qos_t* qos = dds_create_qos();
  dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_SECS(1));
  dds_qset_durability(qos, latched ? DDS_DURABILITY_TRANSIENT_LOCAL : DDS_DURABILITY_VOLATILE);
  if (depth > 0) {
    dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, depth);
  } else {
    dds_qset_history(qos, DDS_HISTORY_KEEP_ALL, 0);
  }
  const dds_data_representation_id_t plain_cdr = DDS_DATA_REPRESENTATION_XCDR1;
  dds_qset_data_representation(qos, 1, &plain_cdr);
  return qos;
}

// Makes a reader or a writer of a topic.
template <class Create>
dds_entity_t endpoint(const Create& create, dds_entity_t participant, const std::string& topic,
                      const void* type, bool latched, int depth) {
  const dds_entity_t made_topic =
      made(dds_create_topic(participant, static_cast<const dds_topic_descriptor_t*>(type), topic.c_str(),
                            nullptr, nullptr),
           "topic");
  dds_qos_t* qos = ros_qos(latched, depth);
  const dds_entity_t made_endpoint = made(create(participant, made_topic, qos, nullptr), "endpoint");
  dds_delete_qos(qos);
  return made_endpoint;
}

// Calls `handle` with each sample that the reader holds; it keeps them.
template <class T, class Handle>
void for_each_sample(dds_entity_t reader, const Handle& handle) {
  void* samples[64] = {nullptr};  // Cyclone DDS lends its own
  dds_sample_info_t infos[64];
  const int count = dds_read(reader, samples, infos, 64, 64);
  for (int i = 0; i < count; ++i)
    if (infos[i].valid_data) handle(*static_cast<const T*>(samples[i]));
  if (count > 0) dds_return_loan(reader, samples, count);
}

std::int64_t now_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

/// Cyclone DDS has text and lists of the caller's, as long as the message is written.
void set_header(std_msgs_msg_dds__Header_& header, const std::string& frame, std::int64_t stamp_ns) {
  header.stamp = {static_cast<std::int32_t>(stamp_ns / 1'000'000'000),
                  static_cast<std::uint32_t>(stamp_ns % 1'000'000'000)};
  header.frame_id = const_cast<char*>(frame.c_str());
}
template <class Sequence, class T>
void lend(Sequence& sequence, const std::vector<T>& values) {
  sequence._length = sequence._maximum = static_cast<std::uint32_t>(values.size());
  sequence._buffer = const_cast<T*>(values.data());
}

template <class Sequence>
auto copied(const Sequence& sequence) {
  return std::vector(sequence._buffer, sequence._buffer + sequence._length);
}
std::int64_t stamp_of(const std_msgs_msg_dds__Header_& header) {
  return header.stamp.sec * std::int64_t{1'000'000'000} + header.stamp.nanosec;
}

// Returns what `heard` makes of each sample that the reader holds.
template <class T, class Hear>
auto all_of(dds_entity_t reader, const Hear& heard) {
  std::vector<decltype(heard(std::declval<const T&>()))> all;
  for_each_sample<T>(reader, [&](const T& sample) { all.push_back(heard(sample)); });
  return all;
}

sensor_msgs_msg_dds__Image_ image(const std::string& frame, const std::string& encoding, std::uint32_t width,
                                  std::uint32_t height, std::uint32_t step,
                                  const std::vector<std::uint8_t>& data) {
  sensor_msgs_msg_dds__Image_ message{};
  set_header(message.header, frame, now_ns());
  message.width = width;
  message.height = height;
  message.encoding = const_cast<char*>(encoding.c_str());
  message.step = step;
  lend(message.data, data);
  return message;
}

std::array<std::uint8_t, 16> octets(const void* data) {
  std::array<std::uint8_t, 16> copy;
  std::memcpy(copy.data(), data, copy.size());
  return copy;
}

std::string user_data_of(const dds_qos_t* qos) {
  void* data = nullptr;
  std::size_t size = 0;
  if (qos == nullptr || !dds_qget_userdata(qos, &data, &size) || data == nullptr) return "";
  std::string text(static_cast<const char*>(data), size);
  dds_free(data);
  return text;
}

template <class Info>
HeardGraph graph_of(const Info& info) {
  HeardGraph graph;
  graph.participant = octets(info.gid.data);
  if (info.node_entities_info_seq._length == 0) return graph;
  const auto& node = info.node_entities_info_seq._buffer[0];
  graph.node = node.node_name;
  graph.node_namespace = node.node_namespace;
  for (const auto& gid : copied(node.reader_gid_seq)) graph.readers.push_back(octets(gid.data));
  for (const auto& gid : copied(node.writer_gid_seq)) graph.writers.push_back(octets(gid.data));
  return graph;
}

}  // namespace

ForeignNode::ForeignNode(int domain, Distribution distribution) : distribution_(distribution) {
  const auto id = static_cast<dds_domainid_t>(domain);
  dds_create_domain(id, kConfiguration);  // fails harmlessly if it is there
  participant_ = made(dds_create_participant(id, nullptr, nullptr), "participant");
  joints_ = endpoint(dds_create_writer, participant_, "rt/joint_states", ros2_joint_state, false, 10);
  wrenches_ = endpoint(dds_create_writer, participant_, "rt/wrench", ros2_wrench, false, 10);
  objects_ =
      endpoint(dds_create_writer, participant_, "rt/collision_object", ros2_collision_object, false, 10);
  const dds_topic_descriptor_t type =
      distribution == Distribution::kHumble ? ros2_graph_of_humble() : ros2_graph_since_iron();
  graph_ = endpoint(dds_create_reader, participant_, "ros_discovery_info", &type, true, 0);
}

ForeignNode::~ForeignNode() { dds_delete(participant_); }

void ForeignNode::publish_joints(const std::vector<std::string>& names, const std::vector<double>& positions,
                                 const std::vector<double>& velocities, std::int64_t stamp_ns) {
  std::vector<char*> texts;
  for (const std::string& name : names) texts.push_back(const_cast<char*>(name.c_str()));
  sensor_msgs_msg_dds__JointState_ message{};
  const std::string frame = "base_link";
  set_header(message.header, frame, stamp_ns);
  lend(message.name, texts);
  lend(message.position, positions);
  lend(message.velocity, velocities);
  dds_write(joints_, &message);
}

void ForeignNode::publish_wrench(const std::string& frame, const std::array<double, 3>& force_N,
                                 const std::array<double, 3>& torque_Nm) {
  geometry_msgs_msg_dds__WrenchStamped_ message{};
  message.header.frame_id = const_cast<char*>(frame.c_str());
  message.wrench.force = {force_N[0], force_N[1], force_N[2]};
  message.wrench.torque = {torque_Nm[0], torque_Nm[1], torque_Nm[2]};
  dds_write(wrenches_, &message);
}

void ForeignNode::publish_object(const std::string& id, int operation,
                                 const std::array<double, 3>& position_m,
                                 const std::vector<Primitive>& primitives, const std::string& frame) {
  moveit_msgs_msg_dds__CollisionObject_ message{};
  char empty[] = "";
  message.header.frame_id = const_cast<char*>(frame.c_str());
  message.id = const_cast<char*>(id.c_str());
  message.type = {empty, empty};
  message.pose.position = {position_m[0], position_m[1], position_m[2]};
  message.pose.orientation.w = 1.0;
  std::vector<shape_msgs_msg_dds__SolidPrimitive_> shapes;
  std::vector<geometry_msgs_msg_dds__Pose_> poses;
  for (const Primitive& primitive : primitives) {
    auto& shape = shapes.emplace_back();
    shape.type = static_cast<std::uint8_t>(primitive.type);
    lend(shape.dimensions, primitive.dimensions_m);
    auto& pose = poses.emplace_back();
    pose.position = {primitive.position_m[0], primitive.position_m[1], primitive.position_m[2]};
    pose.orientation.w = 1.0;
  }
  if (operation == 0) {
    lend(message.primitives, shapes);
    lend(message.primitive_poses, poses);
  }
  message.operation = static_cast<std::uint8_t>(operation);
  dds_write(objects_, &message);
}

void ForeignNode::publish_sphere(const std::string& id, int operation,
                                 const std::array<double, 3>& position_m, double radius_m,
                                 const std::string& frame) {
  publish_object(id, operation, position_m, {{2, {radius_m}, {}}}, frame);
}

std::int32_t ForeignNode::reader_of(const std::string& topic, const void* type, bool latched) {
  std::int32_t& reader = readers_[topic];
  if (reader == 0) reader = endpoint(dds_create_reader, participant_, "rt/" + topic, type, latched, 50);
  return reader;
}

std::int32_t ForeignNode::writer_of(const std::string& topic, const void* type) {
  std::int32_t& writer = writers_[topic];
  if (writer == 0) writer = endpoint(dds_create_writer, participant_, "rt/" + topic, type, false, 10);
  return writer;
}

void ForeignNode::publish_twist(const std::string& frame, const std::array<double, 3>& linear_m_s,
                                const std::array<double, 3>& angular_rad_s) {
  geometry_msgs_msg_dds__TwistStamped_ message{};
  set_header(message.header, frame, now_ns());
  message.twist.linear = {linear_m_s[0], linear_m_s[1], linear_m_s[2]};
  message.twist.angular = {angular_rad_s[0], angular_rad_s[1], angular_rad_s[2]};
  dds_write(writer_of("twist", ros2_twist), &message);
}

void ForeignNode::publish_joy(const std::vector<float>& axes, const std::vector<std::int32_t>& buttons) {
  sensor_msgs_msg_dds__Joy_ message{};
  const std::string frame = "joy";
  set_header(message.header, frame, now_ns());
  lend(message.axes, axes);
  lend(message.buttons, buttons);
  dds_write(writer_of("joy", ros2_joy), &message);
}

void ForeignNode::publish_cloud(const Cloud& cloud) {
  sensor_msgs_msg_dds__PointCloud2_ message{};
  set_header(message.header, cloud.frame, cloud.stamp_ns);
  message.height = cloud.height;
  message.width = cloud.width;
  message.point_step = cloud.point_step;
  message.row_step = cloud.row_step;
  std::vector<sensor_msgs_msg_dds__PointField_> fields;
  for (const auto& [name, offset, datatype, count] : cloud.fields)
    fields.push_back({const_cast<char*>(name.c_str()), offset, datatype, count});
  lend(message.fields, fields);
  lend(message.data, cloud.data);
  dds_write(writer_of("cloud", ros2_cloud), &message);
}

void ForeignNode::publish_camera(const std::string& frame, std::uint32_t width, std::uint32_t height,
                                 const std::array<double, 12>& p) {
  sensor_msgs_msg_dds__CameraInfo_ message{};
  char model[] = "plumb_bob";
  set_header(message.header, frame, now_ns());
  message.width = width;
  message.height = height;
  message.distortion_model = model;
  std::copy(p.begin(), p.end(), message.p);
  dds_write(writer_of("camera_info", ros2_camera_info), &message);
}

void ForeignNode::publish_depth(const std::string& frame, std::uint32_t width, std::uint32_t height,
                                const std::vector<float>& depths_m) {
  std::vector<std::uint8_t> octets(4 * depths_m.size());
  std::memcpy(octets.data(), depths_m.data(), octets.size());
  const std::string encoding = "32FC1";
  const auto message = image(frame, encoding, width, height, 4 * width, octets);
  dds_write(writer_of("depth", ros2_image), &message);
}

void ForeignNode::publish_image(const std::string& encoding, std::uint32_t width, std::uint32_t height,
                                std::uint32_t step, const std::vector<std::uint8_t>& data) {
  const std::string frame = "camera";
  const auto message = image(frame, encoding, width, height, step, data);
  dds_write(writer_of("image", ros2_image), &message);
}

void ForeignNode::publish_compressed(const std::string& format, const std::vector<std::uint8_t>& data) {
  sensor_msgs_msg_dds__CompressedImage_ message{};
  set_header(message.header, "camera", now_ns());
  message.format = const_cast<char*>(format.c_str());
  lend(message.data, data);
  dds_write(writer_of("image/compressed", ros2_picture), &message);
}

std::vector<HeardWrench> ForeignNode::wrenches(const std::string& topic) {
  return all_of<geometry_msgs_msg_dds__WrenchStamped_>(
      reader_of(topic, ros2_wrench, false), [](const auto& m) {
        const auto &f = m.wrench.force, &t = m.wrench.torque;
        return HeardWrench{m.header.frame_id, {f.x, f.y, f.z}, {t.x, t.y, t.z}};
      });
}

std::vector<HeardPicture> ForeignNode::pictures(const std::string& topic) {
  return all_of<sensor_msgs_msg_dds__CompressedImage_>(
      reader_of(topic, ros2_picture, false), [](const auto& m) {
        return HeardPicture{m.header.frame_id, m.format, copied(m.data)};
      });
}

std::vector<std::vector<HeardTriangles>> ForeignNode::marker_arrays(const std::string& topic) {
  return all_of<visualization_msgs_msg_dds__MarkerArray_>(
      reader_of(topic, ros2_markers, true), [](const auto& array) {
        std::vector<HeardTriangles> markers;
        for (const auto& m : copied(array.markers)) {
          const auto& p = m.pose.position;
          const auto& q = m.pose.orientation;
          auto& heard = markers.emplace_back(HeardTriangles{
              m.header.frame_id, m.ns, m.id, m.type, m.action, {p.x, p.y, p.z}, {q.x, q.y, q.z, q.w}, {}});
          for (const auto& point : copied(m.points)) heard.points.push_back({point.x, point.y, point.z});
        }
        return markers;
      });
}

std::vector<Cloud> ForeignNode::clouds(const std::string& topic) {
  return all_of<sensor_msgs_msg_dds__PointCloud2_>(reader_of(topic, ros2_cloud, true), [](const auto& m) {
    Cloud heard;
    heard.frame = m.header.frame_id;
    heard.stamp_ns = stamp_of(m.header);
    heard.height = m.height, heard.width = m.width;
    heard.point_step = m.point_step, heard.row_step = m.row_step;
    for (const auto& f : copied(m.fields)) heard.fields.emplace_back(f.name, f.offset, f.datatype, f.count);
    heard.data = copied(m.data);
    return heard;
  });
}

std::vector<HeardJoints> ForeignNode::joints(const std::string& topic) {
  return all_of<sensor_msgs_msg_dds__JointState_>(reader_of(topic, ros2_joint_state, false),
                                                  [](const auto& m) {
                                                    HeardJoints heard;
                                                    heard.stamp_ns = stamp_of(m.header);
                                                    for (const char* name : copied(m.name))
                                                      heard.name.emplace_back(name);
                                                    heard.position = copied(m.position);
                                                    heard.velocity = copied(m.velocity);
                                                    heard.effort = copied(m.effort);
                                                    return heard;
                                                  });
}

std::vector<double> ForeignNode::numbers(const std::string& topic) {
  return all_of<std_msgs_msg_dds__Float64_>(reader_of(topic, ros2_float64, false),
                                            [](const auto& m) { return m.data; });
}

std::vector<std::string> ForeignNode::texts(const std::string& topic) {
  return all_of<std_msgs_msg_dds__String_>(reader_of(topic, ros2_string, true),
                                           [](const auto& m) { return std::string(m.data); });
}

std::map<std::string, HeardTransform> ForeignNode::transforms(const std::string& topic) {
  std::map<std::string, HeardTransform> all;
  for_each_sample<tf2_msgs_msg_dds__TFMessage_>(
      reader_of(topic, ros2_tf, topic == "tf_static"), [&](const auto& m) {
        for (const auto& one : copied(m.transforms)) {
          const auto &t = one.transform.translation, &r = one.transform.rotation;
          all[one.child_frame_id] = {one.header.frame_id, {t.x, t.y, t.z}, {r.x, r.y, r.z, r.w}};
        }
      });
  return all;
}

std::map<std::string, HeardStatus> ForeignNode::diagnostics() {
  std::map<std::string, HeardStatus> all;
  for_each_sample<diagnostic_msgs_msg_dds__DiagnosticArray_>(
      reader_of("diagnostics", ros2_diagnostics, false), [&](const auto& m) {
        for (const auto& one : copied(m.status)) {
          HeardStatus& heard = all[one.name] = {one.level, one.message, one.hardware_id, {}};
          for (const auto& value : copied(one.values)) heard.values[value.key] = value.value;
        }
      });
  return all;
}

std::vector<HeardMarker> ForeignNode::markers(const std::string& topic) {
  return all_of<visualization_msgs_msg_dds__Marker_>(reader_of(topic, ros2_marker, false), [](const auto& m) {
    const auto& p = m.pose.position;
    return HeardMarker{m.header.frame_id, m.type, m.action, {p.x, p.y, p.z}, m.color.r};
  });
}

std::optional<HeardGraph> ForeignNode::graph() {
  std::optional<HeardGraph> newest;
  const auto keep = [&newest](const auto& info) { newest = graph_of(info); };
  if (distribution_ == Distribution::kHumble) {
    for_each_sample<humble_ParticipantEntitiesInfo_>(graph_, keep);
  } else {
    for_each_sample<iron_ParticipantEntitiesInfo_>(graph_, keep);
  }
  return newest;
}

std::multimap<std::string, HeardEndpoint> ForeignNode::endpoints() {
  std::multimap<std::string, HeardEndpoint> all;
  for (const dds_entity_t topic : {DDS_BUILTIN_TOPIC_DCPSPUBLICATION, DDS_BUILTIN_TOPIC_DCPSSUBSCRIPTION}) {
    const dds_entity_t reader = made(dds_create_reader(participant_, topic, nullptr, nullptr), "builtin");
    for_each_sample<dds_builtintopic_endpoint_t>(reader, [&all](const auto& endpoint) {
      all.insert(
          {endpoint.topic_name, {octets(&endpoint.key), endpoint.type_name, user_data_of(endpoint.qos)}});
    });
    dds_delete(reader);
  }
  return all;
}

std::vector<std::string> ForeignNode::participants() {
  const dds_entity_t reader =
      made(dds_create_reader(participant_, DDS_BUILTIN_TOPIC_DCPSPARTICIPANT, nullptr, nullptr), "builtin");
  const auto all =
      all_of<dds_builtintopic_participant_t>(reader, [](const auto& one) { return user_data_of(one.qos); });
  dds_delete(reader);
  return all;
}

}  // namespace phantom::ros2::test
