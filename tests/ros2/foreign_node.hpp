#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <tuple>
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

struct HeardWrench {
  std::string frame;
  std::array<double, 3> force_N{}, torque_Nm{};
};
struct HeardPicture {
  std::string frame, format;
  std::vector<std::uint8_t> data;
};
/// A marker of a MarkerArray, with its points.
struct HeardTriangles {
  std::string frame, ns;
  int id = 0, type = 0, action = 0;
  std::array<double, 3> position{};
  std::array<double, 4> orientation_xyzw{};
  std::vector<std::array<double, 3>> points;
};
/// A sensor_msgs/msg/PointCloud2, as it came or is to be sent. A field: name, offset, datatype, count.
struct Cloud {
  std::string frame;
  std::int64_t stamp_ns = 0;
  std::uint32_t height = 0, width = 0, point_step = 0, row_step = 0;
  std::vector<std::tuple<std::string, std::uint32_t, std::uint8_t, std::uint32_t>> fields;
  std::vector<std::uint8_t> data;
};

enum class Distribution { kHumble, kSinceIron };

/// A shape_msgs/msg/SolidPrimitive, not turned.
struct Primitive {
  int type = 0;  ///< 1 box, 2 sphere, 3 cylinder
  std::vector<double> dimensions_m;
  std::array<double, 3> position_m{};  ///< in the object's frame
};

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
  /// Publishes a moveit_msgs/msg/CollisionObject; `operation`: 0 ADD, 1 REMOVE, 3 MOVE (its pose alone).
  void publish_object(const std::string& id, int operation, const std::array<double, 3>& position_m,
                      const std::vector<Primitive>& primitives, const std::string& frame = "world");
  void publish_sphere(const std::string& id, int operation, const std::array<double, 3>& position_m,
                      double radius_m, const std::string& frame = "world");
  /// Publish a geometry_msgs/msg/TwistStamped on "twist", a sensor_msgs/msg/Joy on "joy", a cloud on "cloud",
  /// a CameraInfo and an image of depths in m on "camera_info" and "depth". Stamped with this host's time.
  void publish_twist(const std::string& frame, const std::array<double, 3>& linear_m_s,
                     const std::array<double, 3>& angular_rad_s);
  void publish_joy(const std::vector<float>& axes, const std::vector<std::int32_t>& buttons);
  void publish_cloud(const Cloud& cloud);
  void publish_camera(const std::string& frame, std::uint32_t width, std::uint32_t height,
                      const std::array<double, 12>& p);
  void publish_depth(const std::string& frame, std::uint32_t width, std::uint32_t height,
                     const std::vector<float>& depths_m);
  /// Publish a sensor_msgs/msg/Image on "image" and a CompressedImage on "image/compressed", stamped
  /// likewise.
  void publish_image(const std::string& encoding, std::uint32_t width, std::uint32_t height,
                     std::uint32_t step, const std::vector<std::uint8_t>& data);
  void publish_compressed(const std::string& format, const std::vector<std::uint8_t>& data);
  /// Return what came on a topic up to now; nothing before the topic's publisher was discovered. Each topic
  /// has one type in a test.
  std::vector<HeardJoints> joints(const std::string& topic);
  std::vector<double> numbers(const std::string& topic);
  std::vector<std::string> texts(const std::string& topic);
  std::map<std::string, HeardTransform> transforms(const std::string& topic);
  std::map<std::string, HeardStatus> diagnostics();
  std::vector<HeardMarker> markers(const std::string& topic);
  std::vector<HeardWrench> wrenches(const std::string& topic);
  std::vector<HeardPicture> pictures(const std::string& topic);
  /// Of latched topics: each message with its markers; each cloud.
  std::vector<std::vector<HeardTriangles>> marker_arrays(const std::string& topic);
  std::vector<Cloud> clouds(const std::string& topic);
  /// Returns what came last on ros_discovery_info.
  std::optional<HeardGraph> graph();
  /// Returns the readers and writers that were discovered, by topic, and the participants' USER_DATA.
  std::multimap<std::string, HeardEndpoint> endpoints();
  std::vector<std::string> participants();
  /// Its participant, as Cyclone DDS numbers it.
  std::int32_t participant() const { return participant_; }

 private:
  std::int32_t reader_of(const std::string& topic, const void* type, bool latched);
  std::int32_t writer_of(const std::string& topic, const void* type);

  std::map<std::string, std::int32_t> readers_, writers_;
  std::int32_t participant_ = 0, joints_ = 0, objects_ = 0, wrenches_ = 0, graph_ = 0;
  Distribution distribution_;
};

}  // namespace phantom::ros2::test
