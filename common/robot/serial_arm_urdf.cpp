// Reads a serial chain from a URDF file. No other file uses urdfdom.
#include <console_bridge/console.h>
#include <urdf_parser/urdf_parser.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <mutex>
#include <ranges>
#include <set>
#include <sstream>

#include "common/core/text.hpp"
#include "common/geometry/primitives.hpp"
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
  // A model comes in spite of errors in a link: without the visuals from the faulty one on.
  if (!model || !model->getRoot() || !errors.first().empty()) {
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
  if (!link)
    throw Fault{"tip link '" + tip +
                "' is not in the file; its links are: " + core::listed(std::views::keys(model.links_))};
  std::vector<urdf::JointSharedPtr> chain;
  for (; link->parent_joint; link = link->getParent()) chain.push_back(link->parent_joint);
  std::reverse(chain.begin(), chain.end());
  return chain;
}

/// Returns the name, the type and the axis of a joint that turns or slides.
Joint moving_part(const urdf::Joint& source) {
  const Eigen::Vector3d axis(source.axis.x, source.axis.y, source.axis.z);
  if (!(axis.norm() > 1e-9) || !axis.allFinite())
    throw Fault{"joint '" + source.name + "': axis must be a finite vector that is not zero"};
  Joint joint;
  joint.name = source.name;
  joint.axis = axis.normalized();
  joint.type = source.type == urdf::Joint::PRISMATIC ? JointType::kPrismatic : JointType::kRevolute;
  return joint;
}

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Returns the least and the greatest position.
std::pair<double, double> range_of(const urdf::Joint& source) {
  if (source.type == urdf::Joint::CONTINUOUS || !source.limits) return {-kInfinity, kInfinity};
  return {source.limits->lower, source.limits->upper};
}

bool turns_or_slides(const urdf::Joint& source) {
  return source.type == urdf::Joint::REVOLUTE || source.type == urdf::Joint::CONTINUOUS ||
         source.type == urdf::Joint::PRISMATIC;
}

Joint joint_of(const urdf::Joint& source) {
  const std::string place = "joint '" + source.name + "'";
  if (!turns_or_slides(source))
    throw Fault{place + " has an unsupported type; allowed are revolute, continuous, prismatic, fixed"};
  if (source.mimic) {
    throw Fault{place + " mimics another; every moving joint of the chain must move by itself (a finger is " +
                "off the chain if tip_link is the link that carries it)"};
  }
  if (!source.limits) {
    throw Fault{place +
                " has no <limit>; lower, upper, velocity and effort are needed (continuous: the last two)"};
  }
  Joint joint = moving_part(source);
  std::tie(joint.lower, joint.upper) = range_of(source);
  joint.max_speed = source.limits->velocity;
  joint.max_effort = source.limits->effort;
  // Written so that a NaN fails as well.
  if (!(joint.lower < joint.upper)) throw Fault{place + ": limit lower must be less than upper"};
  if (!(joint.max_speed > 0.0) || !std::isfinite(joint.max_speed))
    throw Fault{place + ": limit velocity must be above 0"};
  if (!(joint.max_effort > 0.0) || !std::isfinite(joint.max_effort))
    throw Fault{place + ": limit effort must be above 0"};
  return joint;
}

std::string text_of(double number) { return core::formatted("%g", number); }

/// Where the joints off the chain stand.
class HeldJoints {
 public:
  HeldJoints(const urdf::ModelInterface& model, const std::vector<urdf::JointSharedPtr>& chain,
             const std::map<std::string, double>& stated)
      : model_(model), stated_(stated) {
    for (const auto& joint : chain) {
      if (is_moving(*joint)) in_chain_.insert(joint->name);
    }
    for (const auto& [name, q] : stated) check_stated(name, q);
  }

  /// Returns the motion of a joint off the chain to where it is held.
  geometry::Pose motion(const urdf::Joint& joint) {
    if (!is_moving(joint)) return {};
    const double q = position(joint, 0);
    if (!std::isfinite(q)) throw Fault{"joint '" + joint.name + "' is not held at a finite position"};
    const bool placed = turns_or_slides(joint);
    notice_ += (notice_.empty() ? "joints off the chain are held: " : ", ") + joint.name +
               (placed ? " at " + text_of(q) + (joint.type == urdf::Joint::PRISMATIC ? " m" : " rad")
                       : " at its origin");
    if (joint.mimic) {
      constexpr double kRounding = 1e-6;
      const auto [lower, upper] = range_of(joint);
      const bool beyond = q < lower - kRounding || q > upper + kRounding;
      notice_ += " (as " + joint.mimic->joint_name + (beyond ? ", beyond its own limits)" : ")");
    }
    return placed ? moving_part(joint).motion(q) : geometry::Pose();
  }
  /// Returns which joints were held, in a sentence; empty if there was none.
  const std::string& notice() const { return notice_; }

 private:
  bool can_be_stated(const urdf::Joint& joint) const {
    return turns_or_slides(joint) && !joint.mimic && !in_chain_.contains(joint.name);
  }
  void check_stated(const std::string& name, double q) const {
    const urdf::JointConstSharedPtr joint = model_.getJoint(name);
    if (!joint || !can_be_stated(*joint)) {
      std::string allowed;
      for (const auto& [other, candidate] : model_.joints_)
        if (can_be_stated(*candidate)) core::add_to_list(allowed, other);
      throw Fault{"held_joints: '" + name + "' " +
                  (!joint                     ? "is no joint of the file"
                   : in_chain_.contains(name) ? "is a joint of the chain, which moves"
                   : turns_or_slides(*joint)  ? "mimics " + joint->mimic->joint_name
                                              : "neither turns nor slides") +
                  "; allowed: " + (allowed.empty() ? "none, no joint is held" : allowed)};
    }
    const auto [lower, upper] = range_of(*joint);
    if (!(q >= lower && q <= upper)) {
      throw Fault{"held_joints: " + text_of(q) + " for '" + name +
                  "' is outside of its limits; allowed: " + text_of(lower) + " to " + text_of(upper)};
    }
  }
  double position(const urdf::Joint& joint, std::size_t followed) const {
    const std::string place = "joint '" + joint.name + "'";
    if (!turns_or_slides(joint)) return 0.0;
    if (joint.mimic) {
      const std::string& name = joint.mimic->joint_name;
      const urdf::JointConstSharedPtr leader = model_.getJoint(name);
      if (!leader) throw Fault{place + " mimics '" + name + "', which is not in the file"};
      if (in_chain_.contains(name)) {
        throw Fault{place + " mimics '" + name +
                    "', which moves; a joint off the chain may only mimic another " +
                    "one off the chain, or none"};
      }
      if (followed > model_.joints_.size()) throw Fault{place + " mimics itself by way of '" + name + "'"};
      return joint.mimic->multiplier * position(*leader, followed + 1) + joint.mimic->offset;
    }
    const auto found = stated_.find(joint.name);
    if (found != stated_.end()) return found->second;
    const auto [lower, upper] = range_of(joint);
    if (!(lower <= upper)) throw Fault{place + ": limit lower must be at most upper"};
    return std::clamp(0.0, lower, upper);
  }

  const urdf::ModelInterface& model_;
  const std::map<std::string, double>& stated_;
  std::set<std::string> in_chain_;  // those that move
  std::string notice_;
};

/// What is read beside the chain itself.
struct Reading {
  std::filesystem::path folder;  // the URDF's
  HeldJoints held;
  std::vector<std::string> notices = {};
};

constexpr double kMostLength_m = 1e4;  // as of a cell's shapes

/// Returns the mesh of a box, a cylinder or a sphere; without triangles if one of its lengths is 0.
geometry::TriangleMesh body_of(const urdf::Geometry& shape, const std::string& place) {
  const auto lengths = [&](std::initializer_list<double> all) {
    for (const double length : all) {
      if (!(length >= 0.0 && length <= kMostLength_m))
        throw Fault{place + ": lengths of its geometry must be from 0 to " + text_of(kMostLength_m) + " m"};
    }
    return std::ranges::min(all) > 0.0;
  };
  if (shape.type == urdf::Geometry::BOX) {
    const urdf::Vector3& size = static_cast<const urdf::Box&>(shape).dim;
    if (lengths({size.x, size.y, size.z})) return geometry::make_box({size.x, size.y, size.z});
  } else if (shape.type == urdf::Geometry::CYLINDER) {
    const auto& cylinder = static_cast<const urdf::Cylinder&>(shape);
    if (lengths({cylinder.radius, cylinder.length}))
      return geometry::make_cylinder(cylinder.radius, cylinder.length);
  } else if (lengths({static_cast<const urdf::Sphere&>(shape).radius})) {
    return geometry::make_sphere(static_cast<const urdf::Sphere&>(shape).radius);
  }
  return {};
}

/// Adds a piece of geometry of the URDF link `name`, at `X_link_piece` in the moving link.
void add_mesh(const urdf::Geometry& shape, const geometry::Pose& X_link_piece, const urdf::Material* material,
              const std::string& name, Reading& reading, Link& link) {
  const std::string place = "link '" + name + "'";
  if (!finite(X_link_piece)) throw Fault{place + ": origin of its geometry must be finite numbers"};
  LinkMesh result;
  if (shape.type == urdf::Geometry::MESH) {
    const auto& mesh = static_cast<const urdf::Mesh&>(shape);
    result.file = find_mesh(reading.folder, mesh.filename);
    if (!std::filesystem::is_regular_file(result.file)) {
      throw Fault{place + ": mesh '" + mesh.filename + "' is missing (looked for " + result.file.string() +
                      (is_of_package(mesh.filename) ? " and in the folders above" : "") + ")",
                  true};
    }
    if (is_of_package(mesh.filename) && !lies_in_package(result.file, mesh.filename))
      reading.notices.push_back(place + ": " + mesh.filename + " is taken from " + result.file.string());
    result.scale = {mesh.scale.x, mesh.scale.y, mesh.scale.z};
    if (!result.scale.allFinite() || !(result.scale.cwiseAbs().minCoeff() > 0.0))
      throw Fault{place + ": mesh '" + mesh.filename +
                  "': scale must be three finite numbers, none of them 0"};
  } else {
    result.body = body_of(shape, place);
    if (result.body.triangles.empty()) {
      reading.notices.push_back(place + ": geometry with a length of 0 is left out");
      return;
    }
  }
  result.X_link_mesh = X_link_piece;
  if (material != nullptr) result.colour = {material->color.r, material->color.g, material->color.b};
  link.meshes.push_back(std::move(result));
}

/// Adds what is seen of a URDF link: its visuals or, if it has none, its collision geometry.
void add_meshes(const urdf::Link& source, const geometry::Pose& X_link_frame, Reading& reading, Link& link) {
  for (const auto& visual : source.visual_array) {
    add_mesh(*visual->geometry, X_link_frame * pose_of(visual->origin), visual->material.get(), source.name,
             reading, link);
  }
  if (!source.visual_array.empty() || source.collision_array.empty()) return;
  reading.notices.push_back("link '" + source.name + "' has no visual; its collision geometry stands for it");
  for (const auto& collision : source.collision_array) {
    add_mesh(*collision->geometry, X_link_frame * pose_of(collision->origin), nullptr, source.name, reading,
             link);
  }
}

/// Returns the inertia about the centre of mass, along the axes of the <inertial>'s frame.
Eigen::Matrix3d inertia_of(const urdf::Inertial& body, const std::string& link) {
  Eigen::Matrix3d inertia;
  inertia << body.ixx, body.ixy, body.ixz, body.ixy, body.iyy, body.iyz, body.ixz, body.iyz, body.izz;
  if (!is_inertia(inertia))
    throw Fault{"link '" + link + "': inertia must be finite, with no principal moment below 0"};
  return inertia;
}

/// Adds a URDF link, at `X_link_frame` in the moving link `link`, and everything that is fixed to it or held.
void absorb(const urdf::Link& source, const geometry::Pose& X_link_frame, const std::string& next_in_chain,
            Reading& reading, Link& link) {
  link.frames.emplace_back(source.name, X_link_frame);
  add_meshes(source, X_link_frame, reading, link);
  if (source.inertial) {
    const double mass = source.inertial->mass;
    if (!(mass >= 0.0) || !std::isfinite(mass))
      throw Fault{"link '" + source.name + "': mass must be 0 or above"};
    if (mass > 0.0) {
      const geometry::Pose X_link_body = X_link_frame * pose_of(source.inertial->origin);
      const Eigen::Matrix3d& R = X_link_body.rotation;
      const Eigen::Matrix3d inertia = inertia_of(*source.inertial, source.name);
      link.add_body(mass, X_link_body.translation_m, R * inertia * R.transpose());
    }
  }
  for (const auto& joint : source.child_joints) {
    if (joint->name == next_in_chain) continue;
    const geometry::Pose X_frame_child =
        pose_of(joint->parent_to_joint_origin_transform) * reading.held.motion(*joint);
    if (!finite(X_frame_child)) throw Fault{"joint '" + joint->name + "': origin must be finite numbers"};
    for (const auto& child : source.child_links) {
      if (child->name == joint->child_link_name)
        absorb(*child, X_link_frame * X_frame_child, next_in_chain, reading, link);
    }
  }
}

}  // namespace

core::Expected<SerialArm> SerialArm::from_urdf(const std::filesystem::path& urdf, const std::string& tip_link,
                                               const geometry::Pose& X_WB,
                                               const std::map<std::string, double>& held) {
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

    Reading reading{urdf.parent_path(), HeldJoints(*model, chain, held)};
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
      absorb(*carried, {}, i < chain.size() ? chain[i]->name : std::string(), reading, link);
      arm.links_.push_back(std::move(link));
      if (i == chain.size()) break;
      arm.joints_.push_back(joint_of(*chain[i]));
      arm.joints_.back().X_parent_joint = X_link_frame;
      carried = model->getLink(chain[i]->child_link_name);
      X_link_frame = {};
    }
    arm.notices_ = std::move(reading.notices);
    if (!reading.held.notice().empty()) arm.notices_.push_back(reading.held.notice());
    arm.tip_m_ = arm.find_frame(tip_link)->second.translation_m;
    return arm;
  } catch (const Fault& fault) {
    const std::string message = urdf.string() + ": " + fault.what;
    return fault.missing ? core::Status::not_found(message) : core::Status::invalid_argument(message);
  }
}

}  // namespace phantom::robot
