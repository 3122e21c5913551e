#include "components/ros2_gateway/dds_adapter_objects.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <thread>

#include "common/dds/admission/refusal_log.hpp"
#include "common/messages/codecs/workspace_codec.hpp"
#include "common/messages/requester.hpp"
#include "common/ros2/endpoint.hpp"
#include "components/ros2_gateway/collision_objects.hpp"
#include "ros2_idl/moveit_msgsPubSubTypes.hpp"

namespace phantom::ros2_gateway {
namespace {

using Message = moveit_msgs::msg::dds_::CollisionObject_;
using Commands = std::vector<messages::WorkspaceCommand>;

core::Expected<geometry::Pose> read_pose(const geometry_msgs::msg::dds_::Pose_& pose) {
  const auto& p = pose.position();
  const auto& q = pose.orientation();
  return pose_of({p.x(), p.y(), p.z()}, {q.x(), q.y(), q.z(), q.w()});
}

// Reads the poses of a list of shapes. ROS 2 leaves the lists' lengths to the sender.
template <class Shapes, class Poses, class Take>
core::Status read_shapes(const Shapes& shapes, const Poses& poses, const Take& take) {
  if (shapes.size() != poses.size())
    return core::Status::invalid_argument(std::to_string(shapes.size()) + " shapes with " +
                                          std::to_string(poses.size()) + " poses; allowed: one for each");
  if (shapes.size() > kMaxShapes)
    return core::Status::invalid_argument(std::to_string(shapes.size()) + " shapes; allowed: at most " +
                                          std::to_string(kMaxShapes));
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    const auto X = read_pose(poses[i]);
    if (!X) return X.status();
    take(shapes[i], *X);
  }
  return core::Status::ok();
}

core::Expected<CollisionObject> read(const Message& message) {
  CollisionObject object;
  object.id = message.id();
  object.frame = message.header().frame_id();
  object.operation = message.operation();
  const auto X = read_pose(message.pose());
  if (!X) return X.status();
  object.X_FO = *X;
  core::Status status = read_shapes(message.primitives(), message.primitive_poses(),
                                    [&](const auto& solid, const geometry::Pose& X_OS) {
                                      object.solids.push_back({solid.type(), solid.dimensions(), X_OS});
                                    });
  if (status)
    status = read_shapes(message.meshes(), message.mesh_poses(),
                         [&](const auto& mesh, const geometry::Pose& X_OS) {
                           CollisionObject::Mesh& made = object.meshes.emplace_back();
                           made.X_OS = X_OS;
                           for (const auto& v : mesh.vertices())
                             made.vertices_m.push_back({v.x(), v.y(), v.z()});
                           for (const auto& t : mesh.triangles())
                             made.triangles.push_back(t.vertex_indices());
                         });
  if (!status) return status;
  object.planes = !message.planes().empty();
  return object;
}

}  // namespace

struct CollisionObjects::Impl {
  Impl(dds::Participant& phantom, ros2::Node& node, const std::string& topic, const std::string& its_world,
       double its_timeout_s)
      : world(its_world),
        timeout_s(its_timeout_s),
        requester(phantom, dds::kWorkspaceCommand, dds::kWorkspaceReply),
        objects(node, topic, ros2::kDefault,
                [this](const Message& message, const dds::SampleInfo&) { return take(message); }),
        thread([this] { work(); }) {}
  ~Impl() {
    {
      const std::lock_guard lock(mutex);
      ends = true;
    }
    changed.notify_one();
    requester.cancel();
    thread.join();
  }

  struct Request {
    std::string id;
    int operation;
    Commands commands;
  };

  bool take(const Message& message) {
    const auto object = read(message);
    core::Status status = object.status();
    if (object) {
      auto commands = commands_of(*object, world);
      status = commands.status();
      if (commands && wait({object->id, object->operation, std::move(*commands)})) return true;
      if (commands) status = core::Status(core::ErrorCode::kResourceExhausted, "too many at a time");
    }
    refuse(message.id(), status.message());
    return false;
  }

  // One that asks anew for what still waits takes its place: an object that is tracked has one pose, the
  // newest.
  bool wait(Request&& request) {
    const std::lock_guard lock(mutex);
    const auto last = std::find_if(waiting.rbegin(), waiting.rend(),
                                   [&](const Request& one) { return one.id == request.id; });
    if (last != waiting.rend() && last->operation == request.operation) {
      *last = std::move(request);
      return true;
    }
    if (waiting.size() >= kMaxWaiting) return false;
    waiting.push_back(std::move(request));
    changed.notify_one();
    return true;
  }

  void refuse(const std::string& id, const std::string& why) {
    ++refused;
    const core::Nanoseconds now_ns = core::monotonic_ns();
    const std::lock_guard lock(mutex);
    if (now_ns - logged_since_ns > dds::RefusalLog::kEvery_ns) logged_since_ns = now_ns, logged = 0;
    if (++logged <= kMaxLogged) {
      spdlog::warn("collision object '{:.64}' is refused: {}", id, why);
    } else {
      refusals.refused(why, now_ns);
    }
  }

  void work() {
    for (;;) {
      Request request;
      {
        std::unique_lock lock(mutex);
        changed.wait(lock, [this] { return ends || !waiting.empty(); });
        if (ends) return;
        request = std::move(waiting.front());
        waiting.pop_front();
      }
      ask(request);
    }
  }

  // The answer to the last command counts: one that is added anew need not have been there.
  void ask(const Request& request) {
    std::string why;
    bool carried_out = false;
    for (messages::WorkspaceCommand command : request.commands) {
      command.requester = messages::requester_name("ros2_gateway");
      carried_out = false;
      why = "wva_server does not answer";
      requester.ask(command, timeout_s, [&](const messages::WorkspaceReply& reply) {
        if (reply.outcome == messages::WorkspaceOutcome::kAccepted) return false;
        carried_out = reply.outcome == messages::WorkspaceOutcome::kDone;
        why = reply.message;
        return true;
      });
    }
    if (!carried_out) return refuse(request.id, why);
    ++done;
    spdlog::info("collision object '{}': {}", request.id, why);
  }

  std::string world;
  double timeout_s;
  std::mutex mutex;
  std::condition_variable changed;
  std::deque<Request> waiting;
  // A scene that is refused is logged object by object; what floods, at intervals.
  static constexpr int kMaxLogged = 32;
  int logged = 0;
  core::Nanoseconds logged_since_ns = 0;
  dds::RefusalLog refusals{"collision_object"};
  bool ends = false;
  std::atomic<std::uint64_t> done{0}, refused{0};
  messages::Requester<messages::WorkspaceCommand, messages::WorkspaceReply> requester;
  ros2::Subscription<moveit_msgs::msg::dds_::CollisionObject_PubSubType> objects;
  std::thread thread;
};

CollisionObjects::CollisionObjects(dds::Participant& phantom, ros2::Node& node, const std::string& topic,
                                   const std::string& world, double timeout_s)
    : impl_(std::make_unique<Impl>(phantom, node, topic, world, timeout_s)) {}
CollisionObjects::~CollisionObjects() = default;

std::uint64_t CollisionObjects::done() const { return impl_->done; }
std::uint64_t CollisionObjects::refused() const { return impl_->refused; }

}  // namespace phantom::ros2_gateway
