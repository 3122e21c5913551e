#include "common/ros2/introspection.hpp"

#include <charconv>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <sstream>
#include <stdexcept>

#include "common/diagnostics/decode.hpp"
#include "common/ros2/message_types.hpp"

namespace phantom::ros2 {
namespace {

using diagnostics::Kind;
using diagnostics::Type;
using diagnostics::TypePtr;
using Json = nlohmann::ordered_json;

/// Builds a type's tree of its definition: the fields, then those of each type that it is made of.
class Definition {
 public:
  explicit Definition(const MessageType& type) {
    std::istringstream lines(type.definition);
    std::string part = type.name;
    for (std::string line; std::getline(lines, line);) {
      if (line.starts_with("MSG: ")) {
        part = line.substr(5).insert(line.find('/') - 5, "/msg");
      } else if (!line.starts_with("=") && !line.empty()) {
        fields_[part].push_back(line);
      }
    }
  }

  TypePtr structure(const std::string& name) const {
    Type made{.kind = Kind::kStruct, .name = name};
    for (const std::string& field : fields_.at(name)) {
      const auto space = field.find(' ');
      made.members.push_back({field.substr(space + 1), type_of(field.substr(0, space))});
    }
    return std::make_shared<const Type>(std::move(made));
  }

 private:
  static std::uint32_t number(const std::string& text) {
    return static_cast<std::uint32_t>(std::stoul(text));
  }

  // "float64", "string<=256", "geometry_msgs/Point"; then "[]", "[9]" or "[<=4]".
  TypePtr type_of(const std::string& text) const {
    if (const auto bracket = text.find('['); bracket != std::string::npos) {
      const std::string length = text.substr(bracket + 1, text.size() - bracket - 2);
      const bool bounded = length.starts_with("<=");
      Type made{.kind = length.empty() || bounded ? Kind::kSequence : Kind::kArray};
      made.element = type_of(text.substr(0, bracket));
      if (!length.empty()) made.bound = number(bounded ? length.substr(2) : length);
      return std::make_shared<const Type>(std::move(made));
    }
    static const std::map<std::string, Kind> basic{
        {"bool", Kind::kBoolean},  {"byte", Kind::kOctet},      {"uint8", Kind::kOctet},
        {"char", Kind::kOctet},    {"int16", Kind::kInt16},     {"uint16", Kind::kUint16},
        {"int32", Kind::kInt32},   {"uint32", Kind::kUint32},   {"int64", Kind::kInt64},
        {"uint64", Kind::kUint64}, {"float32", Kind::kFloat32}, {"float64", Kind::kFloat64},
        {"string", Kind::kString}};
    const auto bound = text.find("<=");
    Type made;
    if (bound != std::string::npos) made.bound = number(text.substr(bound + 2));
    const auto found = basic.find(text.substr(0, bound));
    if (found == basic.end()) return structure(std::string(text).insert(text.find('/'), "/msg"));
    made.kind = found->second;
    return std::make_shared<const Type>(std::move(made));
  }

  std::map<std::string, std::vector<std::string>> fields_;
};

// A Gid of either length, as decode() shows octets; its first 16 are the GUID.
diagnostics::Guid guid_of(const Json& gid) {
  const auto& text = gid.at("data").get_ref<const std::string&>();
  diagnostics::Guid guid{};
  for (std::size_t i = 0; i < guid.size() && 2 * i + 2 <= text.size(); ++i)
    std::from_chars(text.data() + 2 * i, text.data() + 2 * i + 2, guid[i], 16);
  return guid;
}

diagnostics::NodeInfo node_of(const Json& info) {
  diagnostics::NodeInfo node;
  const auto space = info.at("node_namespace").get<std::string>();
  node.name = space + (space.ends_with('/') ? "" : "/") + info.at("node_name").get<std::string>();
  for (const char* list : {"writer_gid_seq", "reader_gid_seq"})
    for (const Json& gid : info.at(list)) node.endpoints.push_back(guid_of(gid));
  return node;
}

}  // namespace

diagnostics::TypePtr type_tree(const std::string& dds_type) {
  static std::mutex mutex;
  static std::map<std::string, TypePtr> known;
  const MessageType* type = find_message_type(dds_type);
  if (type == nullptr) return nullptr;
  const std::lock_guard lock(mutex);
  TypePtr& tree = known[dds_type];
  if (!tree) tree = Definition(*type).structure(type->name);
  return tree;
}

std::string ros_topic(const std::string& dds_topic) {
  return dds_topic.starts_with("rt/") ? dds_topic.substr(2) : "";
}

std::string ros_type(const std::string& dds_type) {
  constexpr std::string_view kMiddle = "::msg::dds_::";
  const auto middle = dds_type.find(kMiddle);
  if (middle == std::string::npos || !dds_type.ends_with('_')) return "";
  const auto begin = middle + kMiddle.size();
  return dds_type.substr(0, middle) + "/msg/" + dds_type.substr(begin, dds_type.size() - begin - 1);
}

std::string hash_in(const std::string& user_data) {
  const std::string key = "typehash=";
  const auto begin = user_data.find(key);
  if (begin == std::string::npos) return "";
  return user_data.substr(begin + key.size(), user_data.find(';', begin) - begin - key.size());
}

std::optional<ParticipantNodes> read_graph(std::span<const std::uint8_t> bytes) {
  for (const char* package : {"rmw_dds_common", "rmw_dds_common_humble"}) {
    ParticipantNodes read;
    read.form = type_tree(std::string(package) + "::msg::dds_::ParticipantEntitiesInfo_");
    const auto decoded = diagnostics::decode(*read.form, bytes, {.most_octets = 0});
    if (!decoded) continue;
    read.participant = guid_of(decoded->at("gid"));
    for (const Json& info : decoded->at("node_entities_info_seq")) read.nodes.push_back(node_of(info));
    return read;
  }
  return std::nullopt;
}

}  // namespace phantom::ros2
