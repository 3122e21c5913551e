#include "common/diagnostics/type.hpp"

#include <spdlog/fmt/fmt.h>

#include <set>

namespace phantom::diagnostics {
namespace {

/// Name in IDL and size in CDR of the primitives, in the order of Kind.
struct Primitive {
  const char* name;
  std::size_t size;
};
constexpr Primitive kPrimitives[] = {{"boolean", 1},       {"octet", 1},          {"char", 1},
                                     {"short", 2},         {"unsigned short", 2}, {"long", 4},
                                     {"unsigned long", 4}, {"long long", 8},      {"unsigned long long", 8},
                                     {"float", 4},         {"double", 8}};

std::string bounded(const std::string& of, std::uint32_t bound) {
  return bound == 0 ? of : of + ", " + std::to_string(bound);
}

const Type& scalar_of(const Type& type) {
  return type.kind == Kind::kArray ? scalar_of(*type.element) : type;
}

std::string dimensions(const Type& type) {
  return type.kind == Kind::kArray ? fmt::format("[{}]{}", type.bound, dimensions(*type.element)) : "";
}

void append_idl(const Type& type, std::set<std::string>& done, std::string& text) {
  if (type.element) append_idl(*type.element, done, text);
  if ((type.kind != Kind::kStruct && type.kind != Kind::kEnum) || !done.insert(type.name).second) return;
  for (const Member& member : type.members) append_idl(*member.type, done, text);
  text += (type.kind == Kind::kEnum ? "enum " : "struct ") + type.name + " {\n";
  for (const Literal& literal : type.literals)
    text += "  " + literal.name + ",  // " + std::to_string(literal.value) + "\n";
  for (const Member& member : type.members)
    text += (member.key ? "  @key " : "  ") + idl_name(scalar_of(*member.type)) + " " + member.name +
            dimensions(*member.type) + ";\n";
  text += "};\n";
}

}  // namespace

std::size_t primitive_size(Kind kind) {
  const auto index = static_cast<std::size_t>(kind);
  return kind == Kind::kEnum ? 4 : index < std::size(kPrimitives) ? kPrimitives[index].size : 0;
}

std::size_t least_size(const Type& type) {
  switch (type.kind) {
    case Kind::kString:
    case Kind::kSequence:
      return 4;
    case Kind::kArray:
      return type.bound * least_size(*type.element);
    case Kind::kStruct: {
      std::size_t sum = 0;
      for (const Member& member : type.members) sum += least_size(*member.type);
      return sum;
    }
    default:
      return primitive_size(type.kind);
  }
}

std::string idl_name(const Type& type) {
  switch (type.kind) {
    case Kind::kStruct:
    case Kind::kEnum:
      return type.name;
    case Kind::kString:
      return type.bound == 0 ? "string" : "string<" + std::to_string(type.bound) + ">";
    case Kind::kSequence:
      return "sequence<" + bounded(idl_name(*type.element), type.bound) + ">";
    case Kind::kArray:
      return idl_name(scalar_of(type)) + dimensions(type);
    default:
      return kPrimitives[static_cast<std::size_t>(type.kind)].name;
  }
}

std::string idl_text(const Type& type) {
  std::set<std::string> done;
  std::string text;
  append_idl(type, done, text);
  return text;
}

}  // namespace phantom::diagnostics
