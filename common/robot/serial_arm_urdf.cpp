// Reads a serial chain from a URDF file. No other file uses urdfdom.
#include <console_bridge/console.h>
#include <urdf_parser/urdf_parser.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <mutex>
#include <sstream>

#include "common/robot/serial_arm.hpp"

namespace phantom::robot {
namespace {

/// An error in the file; from_urdf turns it into a Status.
struct Fault {
  std::string what;
  bool missing = false;
};

/// Collects urdfdom's messages about a bad file, which urdfdom would print otherwise.
class ErrorCapture : public console_bridge::OutputHandler {
 public:
  ErrorCapture() { console_bridge::useOutputHandler(this); }
  ~ErrorCapture() override { console_bridge::restorePreviousOutputHandler(); }
  void log(const std::string& text, console_bridge::LogLevel level, const char*, int) override {
    if (level >= console_bridge::CONSOLE_BRIDGE_LOG_ERROR && first_.empty()) first_ = text;
  }
  const std::string& first() const { return first_; }

 private:
  std::string first_;
};

urdf::ModelInterfaceSharedPtr parse(const std::filesystem::path& file) {
  std::ifstream stream(file);
  if (!stream) throw Fault{"cannot be opened; a readable URDF file is needed", true};
  std::stringstream text;
  text << stream.rdbuf();
  static std::mutex handler_is_global;
  const std::lock_guard lock(handler_is_global);
  ErrorCapture errors;
  urdf::ModelInterfaceSharedPtr model;
  std::string thrown;
  try {
    model = urdf::parseURDF(text.str());
  } catch (const std::exception& problem) {
    thrown = problem.what();
  }
  if (!model || !model->getRoot()) {
    const std::string why = errors.first().empty() ? thrown : errors.first();
    throw Fault{"is not a usable URDF: " + (why.empty() ? std::string("no root link") : why)};
  }
  return model;
}

geometry::Pose pose_of(const urdf::Pose& pose) {
  return {geometry::rotation_from_quaternion(
              {pose.rotation.x, pose.rotation.y, pose.rotation.z, pose.rotation.w}),
          {pose.position.x, pose.position.y, pose.position.z}};
}

bool finite(const geometry::Pose& pose) {
  return pose.rotation.allFinite() && pose.translation_m.allFinite();
}

bool is_moving(const urdf::Joint& joint) { return joint.type != urdf::Joint::FIXED; }

/// Returns the chain of URDF joints from the root link to `tip`.
std::vector<urdf::JointSharedPtr> chain_to(const urdf::ModelInterface& model, const std::string& tip) {
  urdf::LinkConstSharedPtr link = model.getLink(tip);
  if (!link) {
    std::string names;
    for (const auto& [name, unused] : model.links_) names += (names.empty() ? "" : ", ") + name;
    throw Fault{"tip link '" + tip + "' is not in the file; its links are: " + names};
  }
  std::vector<urdf::JointSharedPtr> chain;
  for (; link->parent_joint; link = link->getParent()) chain.push_back(link->parent_joint);
  std::reverse(chain.begin(), chain.end());
  return chain;
}

Joint joint_of(const urdf::Joint& source) {
  const std::string place = "joint '" + source.name + "'";
  Joint joint;
  joint.name = source.name;
  switch (source.type) {
    case urdf::Joint::REVOLUTE:
    case urdf::Joint::CONTINUOUS:
      joint.type = JointType::kRevolute;
      break;
    case urdf::Joint::PRISMATIC:
      joint.type = JointType::kPrismatic;
      break;
    default:
      throw Fault{place + " has an unsupported type; allowed are revolute, continuous, prismatic, fixed"};
  }
  if (source.mimic)
    throw Fault{place + " mimics another; every moving joint of the chain must move by itself"};
  if (!source.limits) {
    throw Fault{place +
                " has no <limit>; lower, upper, velocity and effort are needed (continuous: the last two)"};
  }
  const bool endless = source.type == urdf::Joint::CONTINUOUS;
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  joint.lower = endless ? -kInfinity : source.limits->lower;
  joint.upper = endless ? kInfinity : source.limits->upper;
  joint.max_speed = source.limits->velocity;
  joint.max_effort = source.limits->effort;
  // Written so that a NaN fails as well.
  if (!(joint.lower < joint.upper)) throw Fault{place + ": limit lower must be less than upper"};
  if (!(joint.max_speed > 0.0) || !std::isfinite(joint.max_speed))
    throw Fault{place + ": limit velocity must be above 0"};
  if (!(joint.max_effort > 0.0) || !std::isfinite(joint.max_effort))
    throw Fault{place + ": limit effort must be above 0"};
  const Eigen::Vector3d axis(source.axis.x, source.axis.y, source.axis.z);
  if (!(axis.norm() > 1e-9) || !axis.allFinite())
    throw Fault{place + ": axis must be a finite vector that is not zero"};
  joint.axis = axis.normalized();
  return joint;
}

/// Resolves package://, file:// and relative mesh names from the URDF's folder. A package's root is that
/// folder or its parent (the usual <package>/urdf/arm.urdf).
std::filesystem::path resolve_mesh(const std::filesystem::path& folder, const std::string& name) {
  const std::string package = "package://", file = "file://";
  std::string rest = name;
  if (name.starts_with(file)) rest = name.substr(file.size());
  if (name.starts_with(package)) {
    const std::size_t slash = name.find('/', package.size());
    rest = slash == std::string::npos ? std::string() : name.substr(slash + 1);
  }
  const std::filesystem::path beside = folder / rest;  // an absolute `rest` replaces the folder
  if (!std::filesystem::is_regular_file(beside) && name.starts_with(package)) {
    const std::filesystem::path above = folder / ".." / rest;
    if (std::filesystem::is_regular_file(above)) return above.lexically_normal();
  }
  return beside.lexically_normal();
}

LinkMesh mesh_of(const urdf::Visual& visual, const urdf::Mesh& mesh, const geometry::Pose& X_link_frame,
                 const std::filesystem::path& folder, const std::string& link) {
  LinkMesh result;
  result.file = resolve_mesh(folder, mesh.filename);
  if (!std::filesystem::is_regular_file(result.file)) {
    throw Fault{"link '" + link + "': mesh '" + mesh.filename + "' is missing (looked for " +
                    result.file.string() + ")",
                true};
  }
  if (mesh.scale.x != mesh.scale.y || mesh.scale.x != mesh.scale.z || !(mesh.scale.x > 0.0)) {
    throw Fault{"link '" + link + "': mesh '" + mesh.filename +
                "' must have one scale above 0 for x, y and z"};
  }
  result.scale = mesh.scale.x;
  result.X_link_mesh = X_link_frame * pose_of(visual.origin);
  if (visual.material)
    result.colour = {visual.material->color.r, visual.material->color.g, visual.material->color.b};
  return result;
}

/// Adds a URDF link, at `X_link_frame` in the moving link `link`, and everything fixed to it.
void absorb(const urdf::Link& source, const geometry::Pose& X_link_frame, const std::string& next_in_chain,
            const std::filesystem::path& folder, Link& link) {
  link.frames.emplace_back(source.name, X_link_frame);
  for (const auto& visual : source.visual_array) {
    if (visual && visual->geometry && visual->geometry->type == urdf::Geometry::MESH) {
      link.meshes.push_back(mesh_of(*visual, static_cast<const urdf::Mesh&>(*visual->geometry), X_link_frame,
                                    folder, source.name));
    }
  }
  if (source.inertial) {
    const double mass = source.inertial->mass;
    if (!(mass >= 0.0) || !std::isfinite(mass))
      throw Fault{"link '" + source.name + "': mass must be 0 or above"};
    if (mass > 0.0) {
      const Eigen::Vector3d centre = X_link_frame * pose_of(source.inertial->origin).translation_m;
      link.centre_of_mass_m = (link.mass_kg * link.centre_of_mass_m + mass * centre) / (link.mass_kg + mass);
      link.mass_kg += mass;
    }
  }
  for (const auto& joint : source.child_joints) {
    if (joint->name == next_in_chain) continue;
    if (is_moving(*joint)) {
      throw Fault{"joint '" + joint->name + "' leaves the chain at link '" + source.name +
                  "' and moves; only fixed joints may branch off a serial arm"};
    }
    const geometry::Pose X_frame_child = pose_of(joint->parent_to_joint_origin_transform);
    if (!finite(X_frame_child)) throw Fault{"joint '" + joint->name + "': origin must be finite numbers"};
    for (const auto& child : source.child_links) {
      if (child->name == joint->child_link_name)
        absorb(*child, X_link_frame * X_frame_child, next_in_chain, folder, link);
    }
  }
}

}  // namespace

core::Expected<SerialArm> SerialArm::from_urdf(const std::filesystem::path& urdf, const std::string& tip_link,
                                               const geometry::Pose& X_WB) {
  try {
    const urdf::ModelInterfaceSharedPtr model = parse(urdf);
    std::vector<urdf::JointSharedPtr> chain = chain_to(*model, tip_link);
    const auto moving = static_cast<std::size_t>(
        std::count_if(chain.begin(), chain.end(), [](const auto& joint) { return is_moving(*joint); }));
    if (moving == 0)
      throw Fault{"no joint moves between the root and tip link '" + tip_link + "'; at least one is needed"};
    if (moving > core::kMaxJoints) {
      throw Fault{"has " + std::to_string(moving) + " moving joints up to '" + tip_link + "'; at most " +
                  std::to_string(core::kMaxJoints) + " are allowed"};
    }

    SerialArm arm;
    arm.X_WB_ = X_WB;
    // URDF link whose frame is the current moving link's.
    urdf::LinkConstSharedPtr carried = model->getRoot();
    geometry::Pose X_link_frame;  // pose of the chain's latest URDF link in the current moving link
    for (std::size_t i = 0; i <= chain.size(); ++i) {
      // Follow the chain's fixed joints; absorb() makes what they carry part of the link.
      if (i < chain.size()) {
        const geometry::Pose X_frame_joint = pose_of(chain[i]->parent_to_joint_origin_transform);
        if (!finite(X_frame_joint))
          throw Fault{"joint '" + chain[i]->name + "': origin must be finite numbers"};
        X_link_frame = X_link_frame * X_frame_joint;
        if (!is_moving(*chain[i])) continue;
      }
      Link link;
      link.name = carried->name;
      absorb(*carried, {}, i < chain.size() ? chain[i]->name : std::string(), urdf.parent_path(), link);
      arm.links_.push_back(std::move(link));
      if (i == chain.size()) break;
      arm.joints_.push_back(joint_of(*chain[i]));
      arm.joints_.back().X_parent_joint = X_link_frame;
      carried = model->getLink(chain[i]->child_link_name);
      X_link_frame = {};
    }
    arm.tip_m_ = arm.find_frame(tip_link)->second.translation_m;
    return arm;
  } catch (const Fault& fault) {
    const std::string message = urdf.string() + ": " + fault.what;
    return fault.missing ? core::Status::not_found(message) : core::Status::invalid_argument(message);
  }
}

}  // namespace phantom::robot
