#include "common/observation/type_catalogue.hpp"

#include <fastrtps/types/DynamicType.h>
#include <fastrtps/types/DynamicTypeMember.h>
#include <fastrtps/types/MemberDescriptor.h>
#include <fastrtps/types/TypeDescriptor.h>
#include <fastrtps/types/TypeObjectFactory.h>

#include <map>
#include <mutex>
#include <stdexcept>

#include "common/observation/learn_type.hpp"
#include "phantom_idl_types/haptic_deviceTypeObject.h"
#include "phantom_idl_types/perceptTypeObject.h"
#include "phantom_idl_types/statusTypeObject.h"
#include "phantom_idl_types/teleoperationTypeObject.h"
#include "phantom_idl_types/workspaceTypeObject.h"

namespace phantom::observation {
namespace {

namespace types = eprosima::fastrtps::types;
using diagnostics::Kind;
using diagnostics::Type;
using diagnostics::TypePtr;

const std::map<types::TypeKind, Kind> kPrimitives{
    {types::TK_BOOLEAN, Kind::kBoolean}, {types::TK_BYTE, Kind::kOctet},
    {types::TK_CHAR8, Kind::kChar},      {types::TK_INT16, Kind::kInt16},
    {types::TK_UINT16, Kind::kUint16},   {types::TK_INT32, Kind::kInt32},
    {types::TK_UINT32, Kind::kUint32},   {types::TK_INT64, Kind::kInt64},
    {types::TK_UINT64, Kind::kUint64},   {types::TK_FLOAT32, Kind::kFloat32},
    {types::TK_FLOAT64, Kind::kFloat64}};

std::map<types::MemberId, types::DynamicTypeMember*> members_of(const types::DynamicType_ptr& dynamic) {
  std::map<types::MemberId, types::DynamicTypeMember*> members;
  dynamic->get_all_members(members);
  return members;
}

// `scope` is the scope of the topic's type, "phantom::msg::": the descriptions of types that it uses lack
// theirs.
TypePtr described(const types::DynamicType_ptr& dynamic, const std::string& scope);

// double x[2][3] is an array of two arrays of three.
TypePtr array_of(const types::TypeDescriptor& descriptor, const std::string& scope) {
  TypePtr inner = described(descriptor.get_element_type(), scope);
  for (std::uint32_t i = descriptor.get_bounds_size(); i-- > 0;) {
    Type array{.kind = Kind::kArray, .element = inner, .bound = descriptor.get_bounds(i)};
    inner = std::make_shared<Type>(std::move(array));
  }
  return inner;
}

TypePtr described(const types::DynamicType_ptr& dynamic, const std::string& scope) {
  if (dynamic == nullptr) throw std::logic_error("a member without a type");
  const types::TypeDescriptor& descriptor = *dynamic->get_type_descriptor();
  const types::TypeKind kind = dynamic->get_kind();
  if (const auto primitive = kPrimitives.find(kind); primitive != kPrimitives.end())
    return std::make_shared<Type>(Type{.kind = primitive->second});
  Type type;
  type.name = dynamic->get_name();
  if (type.name.find("::") == std::string::npos) type.name.insert(0, scope);
  switch (kind) {
    case types::TK_ALIAS:
      return described(descriptor.get_base_type(), scope);
    case types::TK_ARRAY:
      return array_of(descriptor, scope);
    case types::TK_STRING8:
    case types::TK_SEQUENCE:
      type.kind = kind == types::TK_SEQUENCE ? Kind::kSequence : Kind::kString;
      type.name.clear();
      type.bound = descriptor.get_bounds();
      if (kind == types::TK_SEQUENCE) type.element = described(descriptor.get_element_type(), scope);
      break;
    case types::TK_ENUM:
      type.kind = Kind::kEnum;
      for (const auto& [id, member] : members_of(dynamic)) type.literals.push_back({member->get_name(), id});
      break;
    case types::TK_STRUCTURE:
      type.kind = Kind::kStruct;
      for (const auto& [id, member] : members_of(dynamic)) {
        type.members.push_back({member->get_name(), described(member->get_descriptor()->get_type(), scope),
                                member->key_annotation()});
      }
      break;
    default:
      throw std::logic_error(type.name + ": a kind of type that is not decoded");
  }
  return std::make_shared<Type>(std::move(type));
}

TypePtr looked_up(const std::string& name) {
  static std::once_flag registered;
  std::call_once(registered, [] {
    registerhaptic_deviceTypes();
    registerperceptTypes();
    registerstatusTypes();
    registerteleoperationTypes();
    registerworkspaceTypes();
  });
  const auto* factory = types::TypeObjectFactory::get_instance();
  const auto* identifier = factory->get_type_identifier(name, true);
  const auto* object = factory->get_type_object(name, true);
  if (identifier == nullptr || object == nullptr) return nullptr;
  const auto scope_end = name.rfind("::");
  const std::string scope = scope_end == std::string::npos ? "" : name.substr(0, scope_end + 2);
  return described(factory->build_dynamic_type(name, identifier, object), scope);
}

}  // namespace

void learn_type(const std::string&, const fast_dds::DescribedType&) {}

TypePtr type_of(const std::string& type_name) {
  static std::mutex mutex;
  static std::map<std::string, TypePtr> known;
  const std::lock_guard lock(mutex);
  const auto [place, added] = known.try_emplace(type_name);
  if (added) place->second = looked_up(type_name);
  return place->second;
}

}  // namespace phantom::observation
