#include "common/robot/kinematics/internal/urdf_file.hpp"

#include <console_bridge/console.h>

#include <algorithm>
#include <fstream>
#include <mutex>
#include <sstream>
#include <vector>

#include "common/geometry/mesh/stand_in.hpp"
#include "common/robot/kinematics/link_tree.hpp"

namespace phantom::robot::detail {
namespace {

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

/// Throws a UrdfFault if the file's links are not one tree. `without`: a link that the file does not have.
void check_tree(const urdf::ModelInterface& model, const std::string& without = {}) {
  std::vector<std::string> links;
  for (const auto& [name, link] : model.links_)
    if (name != without) links.push_back(name);
  std::vector<LinkEdge> joints;
  for (const auto& [name, joint] : model.joints_)
    joints.push_back({name, joint->parent_link_name, joint->child_link_name});
  const std::string fault = fault_of_link_tree(links, joints);
  if (!fault.empty()) {
    throw UrdfFault{fault +
                    "; a URDF is a tree, with one root and one joint to each other link (of a closed " +
                    "chain, leave out the joint that closes it)"};
  }
}

/// Throws a UrdfFault that names the links, if they are in closed loops so that none is the root: urdfdom
/// then names none. With one more link there is a root.
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
  if (!stream) throw UrdfFault{"cannot be opened; a readable URDF file is needed", true};
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

}  // namespace

urdf::ModelInterfaceSharedPtr read_urdf_file(const std::filesystem::path& file) {
  if (const std::string other = geometry::stand_in_at(file); !other.empty()) throw UrdfFault{other};
  const std::string text = text_of_file(file);
  Parsed parsed = parse_text(text);
  const std::string left_over = about_xacro(text, {"<xacro:"});
  if (!parsed.model && left_over.empty()) check_rootless(text);
  // A model comes in spite of errors in a link: without the visuals from the faulty one on.
  if (!parsed.model || !parsed.model->getRoot() || !parsed.errors.empty()) {
    const std::string xacro = about_xacro(text, {"<xacro:", "${", "$("});
    throw UrdfFault{"is not a usable URDF: " + (parsed.errors.empty() ? "no root link" : parsed.errors) +
                    (xacro.empty() ? "" : "; " + xacro)};
  }
  if (!left_over.empty()) throw UrdfFault{left_over};
  check_tree(*parsed.model);
  return std::move(parsed.model);
}

}  // namespace phantom::robot::detail
