// Reads a serial chain from a URDF file. No other file uses urdfdom.
#include <console_bridge/console.h>
#include <urdf_parser/urdf_parser.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <mutex>
#include <numbers>
#include <ranges>
#include <set>
#include <sstream>

#include "common/core/text.hpp"
#include "common/geometry/implicit/primitives.hpp"
#include "common/geometry/mesh/stand_in.hpp"
#include "common/robot/kinematics/link_tree.hpp"
#include "common/robot/kinematics/serial_arm.hpp"

namespace phantom::robot {
namespace {

/// An error in the file; from_urdf turns it into a Status.
struct Fault {
  std::string what;
  bool missing = false;
};

/// Collects urdfdom's messages about a bad file, which urdfdom would print otherwise. The first says what is
/// wrong, a later one in which link or joint.
class ErrorCapture : public console_bridge::OutputHandler {
 public:
  ErrorCapture() { console_bridge::useOutputHandler(this); }
  ~ErrorCapture() override { console_bridge::restorePreviousOutputHandler(); }
  void log(const std::string& text, console_bridge::LogLevel level, const char*, int) override {
    constexpr std::size_t kMax = 8;
    if (level >= console_bridge::CONSOLE_BRIDGE_LOG_ERROR && all_.size() < kMax &&
        std::ranges::find(all_, text) == all_.end())
      all_.push_back(text);
  }
  const std::vector<std::string>& all() const { return all_; }

 private:
  std::vector<std::string> all_;
};

/// What urdfdom makes of a text.
struct Parsed {
  urdf::ModelInterfaceSharedPtr model;  // null if it refuses the text
  std::string errors;                   // its messages; a model may come in spite of some
};

/// Frees a model's links one by one: those of a long branch would free one another in as many calls, and
/// those of a closed loop never.
void free_links(urdf::ModelInterfaceSharedPtr model) {
  for (const auto& [name, link] : model->links_) {
    link->child_links.clear();
    link->child_joints.clear();
  }
}

Parsed parse_text(const std::string& text) {
  static std::mutex handler_is_global;
  const std::lock_guard lock(handler_is_global);
  ErrorCapture errors;
  Parsed parsed;
  std::string thrown;
  try {
    if (const urdf::ModelInterfaceSharedPtr model = urdf::parseURDF(text))
      parsed.model = {model.get(), [model](urdf::ModelInterface*) { free_links(model); }};
  } catch (const std::exception& problem) {
    thrown = problem.what();
  }
  for (const std::string& error : errors.all()) parsed.errors += (parsed.errors.empty() ? "" : "; ") + error;
  if (parsed.errors.empty()) parsed.errors = thrown;
  return parsed;
}

/// Throws a Fault if the file's links are not one tree. `without`: a link that the file does not have.
void check_tree(const urdf::ModelInterface& model, const std::string& without = {}) {
  std::vector<std::string> links;
  for (const auto& [name, link] : model.links_)
    if (name != without) links.push_back(name);
  std::vector<LinkEdge> joints;
  for (const auto& [name, joint] : model.joints_)
    joints.push_back({name, joint->parent_link_name, joint->child_link_name});
  const std::string fault = fault_of_link_tree(links, joints);
  if (!fault.empty()) {
    throw Fault{fault + "; a URDF is a tree, with one root and one joint to each other link (of a closed " +
                "chain, leave out the joint that closes it)"};
  }
}

/// Throws a Fault that names the links, if they are in closed loops so that none is the root: urdfdom then
/// names none. With one more link there is a root.
void check_rootless(const std::string& text) {
  const std::string one_more = "phantom/root";
  const std::size_t end = text.rfind("</robot");
  if (end == std::string::npos) return;
  const Parsed parsed =
      parse_text(text.substr(0, end) + "<link name=\"" + one_more + "\"/>" + text.substr(end));
  if (parsed.model) check_tree(*parsed.model, one_more);
}

/// Returns the text with blanks in place of its comments.
std::string without_comments(std::string text) {
  for (std::size_t at = text.find("<!--"); at != std::string::npos; at = text.find("<!--", at)) {
    const std::size_t end = std::min(text.find("-->", at + 4), text.size());
    std::replace_if(
        text.begin() + static_cast<std::ptrdiff_t>(at), text.begin() + static_cast<std::ptrdiff_t>(end),
        [](char c) { return c != '\n'; }, ' ');
  }
  return text;
}

std::string text_of_file(const std::filesystem::path& file) {
  std::ifstream stream(file);
  if (!stream) throw Fault{"cannot be opened; a readable URDF file is needed", true};
  std::stringstream text;
  text << stream.rdbuf();
  return text.str();
}

/// Returns a sentence about xacro that has not been expanded, for the end of a message; empty if there is
/// none. An element of it is never of a URDF; what looks like an expression may stand in parts that are
/// passed over.
std::string about_xacro(const std::string& file, std::initializer_list<std::string_view> marks) {
  const std::string text = without_comments(file);
  for (const std::string_view mark : marks) {
    const std::size_t at = text.find(mark);
    if (at == std::string::npos) continue;
    const std::size_t end = text.find_first_of(mark == "<xacro:" ? " \t\r\n/>" : "\"'<\r\n", at + 1);
    return "line " +
           std::to_string(1 + std::count(text.begin(), text.begin() + static_cast<long>(at), '\n')) +
           " has '" + text.substr(at, std::min<std::size_t>(end - at, 60)) +
           "' of xacro, which has not been expanded; needed is what xacro makes of the file: xacro FILE > " +
           "arm.urdf";
  }
  return {};
}

urdf::ModelInterfaceSharedPtr parse(const std::filesystem::path& file) {
  if (const std::string other = geometry::stand_in_at(file); !other.empty()) throw Fault{other};
  const std::string text = text_of_file(file);
  Parsed parsed = parse_text(text);
  const std::string left_over = about_xacro(text, {"<xacro:"});
  if (!parsed.model && left_over.empty()) check_rootless(text);
  // A model comes in spite of errors in a link: without the visuals from the faulty one on.
  if (!parsed.model || !parsed.model->getRoot() || !parsed.errors.empty()) {
    const std::string xacro = about_xacro(text, {"<xacro:", "${", "$("});
    throw Fault{"is not a usable URDF: " + (parsed.errors.empty() ? "no root link" : parsed.errors) +
                (xacro.empty() ? "" : "; " + xacro)};
  }
  if (!left_over.empty()) throw Fault{left_over};
  check_tree(*parsed.model);
  return std::move(parsed.model);
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

/// Sets `value` to what is stated for the joint, if it is.
void state(const std::map<std::string, double>& stated, const std::string& joint, double& value) {
  if (const auto found = stated.find(joint); found != stated.end()) value = found->second;
}

Joint joint_of(const urdf::Joint& source, const JointLimits& stated) {
  const std::string place = "joint '" + source.name + "'";
  if (!turns_or_slides(source))
    throw Fault{place + " has an unsupported type; allowed are revolute, continuous, prismatic, fixed"};
  if (source.mimic) {
    throw Fault{place + " mimics another; every moving joint of the chain must move by itself (a finger is " +
                "off the chain if tip_link is the link that carries it)"};
  }
  const bool whole = stated.max_speed.contains(source.name) && stated.max_effort.contains(source.name);
  if (!source.limits && !whole) {
    throw Fault{place +
                " has no <limit>; lower, upper, velocity and effort are needed (continuous: the last " +
                "two), there or as lower_limits, upper_limits, max_speeds and max_efforts of the arm's file"};
  }
  Joint joint = moving_part(source);
  std::tie(joint.lower, joint.upper) = range_of(source);
  if (source.limits) {
    joint.max_speed = source.limits->velocity;
    joint.max_effort = source.limits->effort;
  }
  state(stated.lower, source.name, joint.lower);
  state(stated.upper, source.name, joint.upper);
  state(stated.max_speed, source.name, joint.max_speed);
  state(stated.max_effort, source.name, joint.max_effort);
  // Written so that a NaN fails as well.
  if (!(joint.lower < joint.upper)) {
    throw Fault{place + ": limit lower must be less than upper; lower_limits and upper_limits of the arm's " +
                "file may state them"};
  }
  if (!(joint.max_speed > 0.0) || !std::isfinite(joint.max_speed))
    throw Fault{place + ": limit velocity must be above 0; max_speeds of the arm's file may state it"};
  if (!(joint.max_effort > 0.0) || !std::isfinite(joint.max_effort))
    throw Fault{place + ": limit effort must be above 0; max_efforts of the arm's file may state it"};
  return joint;
}

/// Throws a Fault if a stated limit is of no moving joint of the chain.
void check_stated_limits(const JointLimits& stated, const std::vector<urdf::JointSharedPtr>& chain) {
  std::string allowed;
  std::set<std::string> names;
  for (const auto& joint : chain) {
    if (!is_moving(*joint)) continue;
    names.insert(joint->name);
    core::add_to_list(allowed, joint->name);
  }
  const std::pair<const char*, const std::map<std::string, double>&> kAll[] = {
      {"lower_limits", stated.lower},
      {"upper_limits", stated.upper},
      {"max_speeds", stated.max_speed},
      {"max_efforts", stated.max_effort}};
  for (const auto& [key, values] : kAll) {
    for (const auto& [name, value] : values) {
      if (!names.contains(name))
        throw Fault{std::string(key) + ": '" + name +
                    "' is no moving joint of the chain; allowed: " + allowed};
    }
  }
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
    const double q = position(joint);
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
  /// Returns where a joint off the chain stands: where its mimics lead to, or where it is stated to be.
  double position(const urdf::Joint& joint) const {
    double factor = 1.0, offset = 0.0;
    const urdf::Joint* at = &joint;
    for (std::size_t followed = 0; turns_or_slides(*at) && at->mimic; ++followed) {
      const std::string place = "joint '" + at->name + "' mimics ";
      const std::string& name = at->mimic->joint_name;
      if (followed > model_.joints_.size()) throw Fault{place + "itself by way of '" + name + "'"};
      const urdf::JointConstSharedPtr leader = model_.getJoint(name);
      if (!leader) throw Fault{place + "'" + name + "', which is not in the file"};
      if (in_chain_.contains(name)) {
        throw Fault{place + "'" + name + "', which moves; a joint off the chain may only mimic another " +
                    "one off the chain, or none"};
      }
      offset += factor * at->mimic->offset;
      factor *= at->mimic->multiplier;
      at = leader.get();
    }
    return factor * own_position(*at) + offset;
  }
  double own_position(const urdf::Joint& joint) const {
    if (!turns_or_slides(joint)) return 0.0;
    const auto found = stated_.find(joint.name);
    if (found != stated_.end()) return found->second;
    const auto [lower, upper] = range_of(joint);
    if (!(lower <= upper)) throw Fault{"joint '" + joint.name + "': limit lower must be at most upper"};
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
  std::size_t moved = 0;         // meshes of packages that are taken from elsewhere
  std::string first_moved = {};  // the first, in a sentence
};

/// Adds what is passed over, or looks like a mistake, in a moving joint of the chain.
void note_limits(const urdf::Joint& source, const Joint& joint, std::vector<std::string>& notices) {
  const std::string place = "joint '" + source.name + "': ";
  const auto range = [](double lower, double upper) { return text_of(lower) + " to " + text_of(upper); };
  if (source.safety) {
    const auto& soft = *source.safety;
    const bool stated = soft.soft_lower_limit < soft.soft_upper_limit;
    if (stated && (soft.soft_lower_limit > joint.lower || soft.soft_upper_limit < joint.upper)) {
      notices.push_back(place + "the soft limits of its <safety_controller>, " +
                        range(soft.soft_lower_limit, soft.soft_upper_limit) +
                        ", are not applied; its range is " + range(joint.lower, joint.upper) +
                        " (lower_limits and upper_limits of the arm's file may state them)");
    }
  }
  constexpr double kFourTurns_rad = 8 * std::numbers::pi;
  if (source.type == urdf::Joint::REVOLUTE && std::max(-joint.lower, joint.upper) > kFourTurns_rad) {
    notices.push_back(place + "its range, " + range(joint.lower, joint.upper) +
                      " rad, is more than four turns to a side: a URDF is in radians, not in degrees");
  }
}

/// Adds which moving links have no mass.
void note_mass(const std::vector<Link>& links, std::vector<std::string>& notices) {
  std::string without;
  bool all = true;
  for (std::size_t i = 1; i < links.size(); ++i) {
    if (links[i].mass_kg > 0.0) {
      all = false;
    } else {
      core::add_to_list(without, "'" + links[i].name + "'");
    }
  }
  if (all) {
    notices.emplace_back(
        "no moving link has a mass (<inertial>): the arm's weight and inertia are not known");
  } else if (!without.empty()) {
    notices.push_back("links without mass (<inertial>): " + without);
  }
}

constexpr double kMaxLength_m = 1e4;  // as of a cell's shapes

/// Returns the mesh of a box, a cylinder or a sphere; without triangles if one of its lengths is 0.
geometry::TriangleMesh body_of(const urdf::Geometry& shape, const std::string& place) {
  const auto lengths = [&](std::initializer_list<double> all) {
    for (const double length : all) {
      if (!(length >= 0.0 && length <= kMaxLength_m))
        throw Fault{place + ": lengths of its geometry must be from 0 to " + text_of(kMaxLength_m) + " m"};
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

/// Returns what is odd about the name of a mesh file that is missing, for the end of a message.
std::string about_mesh_name(const std::string& name) {
  if (name.find("$(") != std::string::npos || name.find("${") != std::string::npos)
    return "; it holds xacro that has not been expanded: needed is what xacro makes of the URDF";
  if (name.find('\\') != std::string::npos) return "; it has '\\' where a URDF has '/'";
  const std::size_t scheme = name.find("://");
  if (scheme != std::string::npos && !is_of_package(name) && !name.starts_with("file://"))
    return "; '" + name.substr(0, scheme) + "' is not read: allowed are package://, file:// and plain paths";
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
                      (is_of_package(mesh.filename) ? " and in the folders above" : "") + ")" +
                      about_mesh_name(mesh.filename),
                  true};
    }
    if (is_of_package(mesh.filename) && !lies_in_package(result.file, mesh.filename) && reading.moved++ == 0)
      reading.first_moved = place + ": " + mesh.filename + " is taken from " + result.file.string();
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

constexpr double kRoundedInertia = 0.01;  // files give inertias with few digits
constexpr double kMaxGyration_m = 5.0;    // no link of a manipulator is larger

Eigen::Vector3d principal_moments(const Eigen::Matrix3d& inertia_kg_m2) {
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(inertia_kg_m2, Eigen::EigenvaluesOnly).eigenvalues();
}

/// Returns the inertia about the centre of mass, along the axes of the <inertial>'s frame.
Eigen::Matrix3d inertia_of(const urdf::Inertial& body, const std::string& link,
                           std::vector<std::string>& notices) {
  Eigen::Matrix3d inertia;
  inertia << body.ixx, body.ixy, body.ixz, body.ixy, body.iyy, body.iyz, body.ixz, body.iyz, body.izz;
  if (!is_inertia(inertia))
    throw Fault{"link '" + link + "': inertia must be finite, with no principal moment below 0"};
  const Eigen::Vector3d principal = principal_moments(inertia);
  const double greatest = principal.maxCoeff(), others = principal.sum() - greatest;
  const std::string moments =
      core::listed(principal, [](double moment) { return text_of(moment); }) + " kg·m²";
  if (greatest > others * (1.0 + kRoundedInertia)) {
    notices.push_back("link '" + link + "': no body has its inertia, of the principal moments " + moments +
                      ": the greatest may not exceed the sum of the others");
  }
  const double gyration_m = std::sqrt(greatest / body.mass);
  if (gyration_m > kMaxGyration_m) {
    notices.push_back("link '" + link + "': its inertia, " + moments + ", is that of a body with its " +
                      text_of(body.mass) + " kg " + text_of(gyration_m) +
                      " m from its middle: a URDF is in kg and m");
  }
  return inertia;
}

/// Adds a URDF link, at `X_link_frame` in the moving link `link`.
void absorb_one(const urdf::Link& source, const geometry::Pose& X_link_frame, Reading& reading, Link& link) {
  link.frames.emplace_back(source.name, X_link_frame);
  add_meshes(source, X_link_frame, reading, link);
  if (!source.inertial) return;
  const double mass = source.inertial->mass;
  if (!(mass >= 0.0) || !std::isfinite(mass))
    throw Fault{"link '" + source.name + "': mass must be 0 or above"};
  if (!(mass > 0.0)) return;
  const geometry::Pose X_link_body = X_link_frame * pose_of(source.inertial->origin);
  const Eigen::Matrix3d& R = X_link_body.rotation;
  const Eigen::Matrix3d inertia = inertia_of(*source.inertial, source.name, reading.notices);
  link.add_body(mass, X_link_body.translation_m, R * inertia * R.transpose());
}

/// Adds the URDF link that the moving link `link` is named after, and everything that is fixed to it or held,
/// depth first; a branch may be of any depth.
void absorb(const urdf::ModelInterface& model, const urdf::Link& carried, const std::string& next_in_chain,
            Reading& reading, Link& link) {
  struct Branch {
    const urdf::Joint* joint;
    geometry::Pose X_link_parent;
  };
  std::vector<Branch> open;
  const auto add = [&](const urdf::Link& source, const geometry::Pose& X_link_frame) {
    absorb_one(source, X_link_frame, reading, link);
    for (const auto& joint : std::views::reverse(source.child_joints))
      if (joint->name != next_in_chain) open.push_back({joint.get(), X_link_frame});
  };
  add(carried, {});
  while (!open.empty()) {
    const auto [joint, X_link_parent] = open.back();
    open.pop_back();
    const geometry::Pose X_parent_child =
        pose_of(joint->parent_to_joint_origin_transform) * reading.held.motion(*joint);
    if (!finite(X_parent_child)) throw Fault{"joint '" + joint->name + "': origin must be finite numbers"};
    add(*model.getLink(joint->child_link_name), X_link_parent * X_parent_child);
  }
}

}  // namespace

core::Expected<SerialArm> SerialArm::from_urdf(const std::filesystem::path& urdf, const std::string& tip_link,
                                               const geometry::Pose& X_WB,
                                               const std::map<std::string, double>& held,
                                               const JointLimits& limits) {
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

    check_stated_limits(limits, chain);

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
      absorb(*model, *carried, i < chain.size() ? chain[i]->name : std::string(), reading, link);
      arm.links_.push_back(std::move(link));
      if (i == chain.size()) break;
      arm.joints_.push_back(joint_of(*chain[i], limits));
      note_limits(*chain[i], arm.joints_.back(), reading.notices);
      arm.joints_.back().X_parent_joint = X_link_frame;
      carried = model->getLink(chain[i]->child_link_name);
      X_link_frame = {};
    }
    arm.notices_ = std::move(reading.notices);
    if (reading.moved > 1)
      reading.first_moved += "; so are " + std::to_string(reading.moved - 1) + " more meshes of packages";
    if (reading.moved > 0) arm.notices_.push_back(reading.first_moved);
    note_mass(arm.links_, arm.notices_);
    if (!reading.held.notice().empty()) arm.notices_.push_back(reading.held.notice());
    arm.tip_m_ = arm.find_frame(tip_link)->second.translation_m;
    return arm;
  } catch (const Fault& fault) {
    const std::string message = urdf.string() + ": " + fault.what;
    return fault.missing ? core::Status::not_found(message) : core::Status::invalid_argument(message);
  }
}

}  // namespace phantom::robot
