#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace phantom::ros2::test {

/// What a node of ROS 2 hears of another node's graph: its name, and the identifiers of its endpoints.
struct HeardGraph {
  std::string node, node_namespace;
  std::vector<std::array<std::uint8_t, 16>> readers, writers;
  std::array<std::uint8_t, 16> participant{};
};

/// An endpoint as discovery describes it.
struct HeardEndpoint {
  std::array<std::uint8_t, 16> guid{};
  std::string type, user_data;
};

/// A sensor_msgs/msg/JointState, a transform, a status of diagnostics and a visualization_msgs/msg/Marker as
/// they came.
struct HeardJoints {
  std::int64_t stamp_ns = 0;
  std::vector<std::string> name;
  std::vector<double> position, velocity, effort;
};
struct HeardTransform {
  std::string parent;
  std::array<double, 3> translation{};
  std::array<double, 4> rotation_xyzw{};
};
struct HeardStatus {
  int level = 0;
  std::string message, hardware_id;
  std::map<std::string, std::string> values;
};
struct HeardMarker {
  std::string frame;
  int type = 0, action = 0;
  std::array<double, 3> position{};
  float red = 0.0F;
};

enum class Distribution { kHumble, kSinceIron };

/// A node of ROS 2 in another vendor's DDS (Cyclone DDS, on loopback), with types written by hand after the
/// published definitions: a robot that publishes its joints, and hears the graph of one distribution.
class ForeignNode {
 public:
  ForeignNode(int domain, Distribution distribution);
  ~ForeignNode();
  ForeignNode(const ForeignNode&) = delete;

  void publish_joints(const std::vector<std::string>& names, const std::vector<double>& positions,
                      const std::vector<double>& velocities, std::int64_t stamp_ns);
  /// Publishes a geometry_msgs/msg/WrenchStamped on "wrench".
  void publish_wrench(const std::string& frame, const std::array<double, 3>& force_N,
                      const std::array<double, 3>& torque_Nm);
  /// Publishes a sphere as a moveit_msgs/msg/CollisionObject; `operation`: 0 ADD, 1 REMOVE, 3 MOVE (its pose
  /// alone).
  void publish_sphere(const std::string& id, int operation, const std::array<double, 3>& position_m,
                      double radius_m, const std::string& frame = "world");
  /// Return what came on a topic up to now; nothing before the topic's publisher was discovered. Each topic
  /// has one type in a test.
  std::vector<HeardJoints> joints(const std::string& topic);
  std::vector<double> numbers(const std::string& topic);
  std::vector<std::string> texts(const std::string& topic);
  std::map<std::string, HeardTransform> transforms(const std::string& topic);
  std::map<std::string, HeardStatus> diagnostics();
  std::vector<HeardMarker> markers(const std::string& topic);
  /// Returns what came last on ros_discovery_info.
  std::optional<HeardGraph> graph();
  /// Returns the readers and writers that were discovered, by topic, and the participants' USER_DATA.
  std::multimap<std::string, HeardEndpoint> endpoints();
  std::vector<std::string> participants();

 private:
  std::int32_t reader_of(const std::string& topic, const void* type, bool latched);

  std::map<std::string, std::int32_t> readers_;
  std::int32_t participant_ = 0, joints_ = 0, objects_ = 0, wrenches_ = 0, graph_ = 0;
  Distribution distribution_;
};

}  // namespace phantom::ros2::test
