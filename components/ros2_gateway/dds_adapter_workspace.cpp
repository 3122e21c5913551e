#include "components/ros2_gateway/dds_adapter_workspace.hpp"

#include <condition_variable>
#include <deque>
#include <mutex>
#include <optional>
#include <thread>

#include "common/dds/admission/refusal_log.hpp"
#include "common/messages/codecs/workspace_codec.hpp"
#include "common/messages/object_sources.hpp"
#include "common/messages/workspace_follower.hpp"
#include "common/ros2/endpoint.hpp"
#include "common/ros2/words.hpp"
#include "components/ros2_gateway/layer_clouds.hpp"
#include "components/ros2_gateway/object_markers.hpp"
#include "ros2_idl/sensor_msgsPubSubTypes.hpp"
#include "ros2_idl/visualization_msgsPubSubTypes.hpp"

namespace phantom::ros2_gateway {
namespace {

namespace vis = visualization_msgs::msg::dds_;
namespace sensor = sensor_msgs::msg::dds_;
constexpr std::int32_t kTriangleList = 11, kAddMarker = 0, kDeleteMarker = 2, kDeleteAllMarkers = 3;
constexpr int kMaxUpdates = 16;  // between two whole clouds; so many are kept for who comes late
constexpr dds::QosContract kLatchedUpdates{.durability = dds::Durability::kTransientLocal,
                                           .history_depth = kMaxUpdates};
constexpr std::size_t kMaxWorkspaceBytes = std::size_t{4} << 30;
constexpr std::size_t kMaxCloudPoints = 4'000'000;  // of a message: 80 MB
constexpr double kTurn_s = 0.1;

vis::Marker_ marker_of(const ObjectMarker& from, const OutputRules& rules) {
  vis::Marker_ marker;
  marker.header(
      ros2::header(from.frame.empty() ? rules.world : rules.frame_prefix + from.frame, core::utc_ns()));
  marker.ns("phantom/objects");
  marker.id(from.id);
  marker.type(kTriangleList);
  marker.action(from.there ? kAddMarker : kDeleteMarker);
  marker.frame_locked(true);
  marker.pose(ros2::pose_message(from.X_FO));
  marker.scale().x(1.0), marker.scale().y(1.0), marker.scale().z(1.0);
  marker.color().r(from.colour[0]), marker.color().g(from.colour[1]), marker.color().b(from.colour[2]);
  marker.color().a(from.opacity);
  if (!from.there) return marker;
  marker.points().reserve(3 * from.mesh->triangles.size());
  for (const auto& triangle : from.mesh->triangles)
    for (const std::uint32_t vertex : triangle) {
      geometry_msgs::msg::dds_::Point_ point;
      const Eigen::Vector3f& p = from.mesh->vertices_m[vertex];
      point.x(p.x()), point.y(p.y()), point.z(p.z());
      marker.points().push_back(point);
    }
  return marker;
}

sensor::PointCloud2_ cloud_of(std::vector<std::uint8_t> points, const std::string& frame) {
  sensor::PointCloud2_ cloud;
  cloud.header(ros2::header(frame, core::utc_ns()));
  const auto add = [&cloud](const char* name, std::uint32_t offset, std::uint8_t datatype) {
    sensor::PointField_ field;
    field.name(name), field.offset(offset), field.datatype(datatype), field.count(1);
    cloud.fields().push_back(field);
  };
  constexpr std::uint8_t kInt16 = 3, kUint16 = 4, kUint32 = 6, kFloat32 = 7;
  add("x", 0, kFloat32), add("y", 4, kFloat32), add("z", 8, kFloat32);
  add("brick", 12, kUint32), add("object", 16, kUint16), add("layer", 18, kInt16);
  cloud.height(1);
  cloud.width(static_cast<std::uint32_t>(points.size() / LayerCloud::kPointStep));
  cloud.point_step(LayerCloud::kPointStep);
  cloud.row_step(static_cast<std::uint32_t>(points.size()));
  cloud.is_bigendian(false);
  cloud.is_dense(false);
  cloud.data(std::move(points));
  return cloud;
}

/// Says when what has been sent in parts is to be sent whole again.
class WholeAgain {
 public:
  void changed(core::Nanoseconds now_ns) {
    if (first_ns_ == 0) first_ns_ = now_ns;
    last_ns_ = now_ns;
    ++count_;
  }
  bool due(core::Nanoseconds now_ns) const {
    if (first_ns_ == 0) return false;
    return core::seconds(now_ns - last_ns_) >= WorkspaceOutputs::kSettle_s ||
           core::seconds(now_ns - first_ns_) >= WorkspaceOutputs::kMax_s || count_ >= kMaxUpdates;
  }
  bool pending() const { return first_ns_ != 0; }
  void sent() { *this = {}; }

 private:
  core::Nanoseconds first_ns_ = 0, last_ns_ = 0;
  int count_ = 0;
};

/// A layer's cloud and its two topics.
struct CloudTopic {
  CloudTopic(ros2::Node& node, const std::string& name, std::int8_t order)
      : layer(order), whole(node, name, ros2::kLatched), updates(node, name + "_updates", kLatchedUpdates) {}

  void send(std::vector<std::uint8_t> points, ros2::Publisher<sensor::PointCloud2_PubSubType>& to,
            const std::string& frame) {
    if (points.size() / LayerCloud::kPointStep > kMaxCloudPoints)
      return refusals.refused("it has more than " + std::to_string(kMaxCloudPoints) + " points");
    to.publish(cloud_of(std::move(points), frame));
  }
  void take(const workspace::Workspace& workspace, const std::string& frame, core::Nanoseconds now_ns) {
    auto changed = layer.update(workspace);
    if (!known) {
      known = true;
      return send(layer.whole(), whole, frame);
    }
    if (changed.empty()) return;
    send(std::move(changed), updates, frame);
    again.changed(now_ns);
  }
  void look(const std::string& frame, core::Nanoseconds now_ns) {
    if (!again.due(now_ns)) return;
    send(layer.whole(), whole, frame);
    again.sent();
  }

  LayerCloud layer;
  bool known = false;  // a whole cloud has been sent
  WholeAgain again;
  dds::RefusalLog refusals{"a cloud of the workspace"};
  ros2::Publisher<sensor::PointCloud2_PubSubType> whole, updates;
};

}  // namespace

struct WorkspaceOutputs::Impl {
  Impl(dds::Participant& phantom, ros2::Node& node, const robot::SerialArm& arm, const OutputRules& out,
       const WorkspaceRules& its_rules)
      : rules(out), markers(arm, its_rules.arm, its_rules.zones) {
    if (its_rules.meshes) {
      objects_out.emplace(node, rules.prefix + "/workspace/meshes", ros2::kLatched);
      hear_meshes(phantom);
    }
    for (const std::int8_t order : its_rules.clouds)
      clouds.emplace_back(node, rules.prefix + "/" + topic_of(order), order);
    if (!clouds.empty()) bricks.emplace(phantom, kMaxWorkspaceBytes);
    versions.emplace(
        phantom, dds::kWorkspaceVersion,
        [this](const msg::WorkspaceVersion& message, const dds::SampleInfo& info) {
          return take(message, info);
        },
        [this](const dds::GuidPrefix& server) {
          const std::lock_guard lock(mutex);
          put(objects.gone(server));
          markers.take(objects.carried());
        });
    thread = std::jthread([this](const std::stop_token& stop) {
      std::unique_lock lock(mutex);
      while (!stop.stop_requested()) {
        turn(lock);
        changed.wait_for(lock, stop, std::chrono::duration<double>(kTurn_s), [] { return false; });
      }
    });
  }

  void hear_meshes(dds::Participant& phantom) {
    objects_in.emplace(phantom, dds::kWorkspaceObject,
                       [this](const msg::WorkspaceObject& message, const dds::SampleInfo& info) {
                         const auto object = messages::from_idl(message);
                         if (!object) return refuse(object.status());
                         const std::lock_guard lock(mutex);
                         const auto taken = objects.take(info.writer, *object);
                         put(taken.changes);
                         return taken.accepted;
                       });
    chunks.emplace(phantom, dds::kMeshChunk, [this](const msg::MeshChunk& message, const dds::SampleInfo&) {
      auto chunk = messages::from_idl(message);
      if (!chunk) return refuse(chunk.status());
      const std::lock_guard lock(mutex);
      return refuse(markers.take(std::move(*chunk)));
    });
  }

  bool take(const msg::WorkspaceVersion& message, const dds::SampleInfo& info) {
    auto version = messages::from_idl(message);
    if (!version) return refuse(version.status());
    const std::lock_guard lock(mutex);
    put(objects.commit(info.writer, *std::move(version)).changes);
    markers.take(objects.carried());
    return true;
  }
  void put(const std::vector<messages::WorkspaceObject>& changes) {
    for (const messages::WorkspaceObject& object : changes) markers.take(object);
  }
  /// Returns whether nothing is to be refused; logs why else.
  bool refuse(const core::Status& status) {
    if (!status) refusals.refused(status.message());
    return static_cast<bool>(status);
  }

  /// Publishes what is new; `lock` is free meanwhile.
  void turn(std::unique_lock<std::mutex>& lock) {
    const core::Nanoseconds now_ns = core::monotonic_ns();
    std::vector<ObjectMarker> moved = markers.changes();
    if (!moved.empty()) objects_again.changed(now_ns);
    // Readers without a history of ours, as RViz is by default, see what is there, too.
    const std::uint32_t matched = objects_out ? objects_out->matched() : 0;
    const bool whole = objects_again.due(now_ns) || matched > readers;
    readers = matched;
    if (whole) moved = markers.all();
    lock.unlock();
    if (objects_out && (whole || !moved.empty())) send(moved, whole);
    if (whole) objects_again.sent();
    const auto workspace = bricks ? bricks->take() : nullptr;
    for (CloudTopic& cloud : clouds) {
      if (workspace && workspace != last) cloud.take(*workspace, rules.world, now_ns);
      cloud.look(rules.world, now_ns);
    }
    last = workspace;
    lock.lock();
  }
  void send(const std::vector<ObjectMarker>& all, bool whole) {
    vis::MarkerArray_ array;
    if (whole) {
      vis::Marker_ none;
      none.header(ros2::header(rules.world, core::utc_ns()));
      none.ns("phantom/objects");
      none.action(kDeleteAllMarkers);
      none.pose().orientation().w(1.0);
      array.markers().push_back(none);
    }
    for (const ObjectMarker& one : all) array.markers().push_back(marker_of(one, rules));
    objects_out->publish(array);
  }

  OutputRules rules;
  std::mutex mutex;
  std::condition_variable_any changed;
  messages::ObjectSources objects;
  ObjectMarkers markers;
  WholeAgain objects_again;
  std::uint32_t readers = 0;
  std::shared_ptr<const workspace::Workspace> last;
  dds::RefusalLog refusals{"the workspace"};
  std::optional<ros2::Publisher<vis::MarkerArray_PubSubType>> objects_out;
  std::deque<CloudTopic> clouds;  // they do not move
  std::optional<messages::WorkspaceFollower> bricks;
  std::optional<dds::Reader<msg::WorkspaceObject>> objects_in;
  std::optional<dds::Reader<msg::MeshChunk>> chunks;
  std::optional<dds::Reader<msg::WorkspaceVersion>> versions;
  std::jthread thread;
};

WorkspaceOutputs::WorkspaceOutputs(dds::Participant& phantom, ros2::Node& node, const robot::SerialArm& arm,
                                   const OutputRules& out, const WorkspaceRules& rules)
    : impl_(std::make_unique<Impl>(phantom, node, arm, out, rules)) {}
WorkspaceOutputs::~WorkspaceOutputs() = default;

std::string WorkspaceOutputs::topic_of(std::int8_t order) {
  if (order == workspace::kOrderBoundary) return "workspace/boundary";
  if (order == workspace::kOrderGuard) return "workspace/guard";
  return "workspace/layer_" + std::string(order < 0 ? "minus_" : "") + std::to_string(std::abs(order));
}

}  // namespace phantom::ros2_gateway
