// Samples as anybody may send them on a topic, read by descriptions of types that have every kind of member.

#include <cstdint>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <vector>

#include "common/diagnostics/decode.hpp"
#include "common/diagnostics/text.hpp"

namespace {

using phantom::diagnostics::Kind;
using phantom::diagnostics::Member;
using phantom::diagnostics::Type;
using phantom::diagnostics::TypePtr;

TypePtr of(Type type) { return std::make_shared<Type>(std::move(type)); }
TypePtr of(Kind kind) { return of(Type{.kind = kind}); }
TypePtr many(Kind kind, TypePtr element, std::uint32_t bound) {
  return of(Type{.kind = kind, .element = std::move(element), .bound = bound});
}

TypePtr every_kind() {
  std::vector<Member> members;
  for (const Kind kind :
       {Kind::kBoolean, Kind::kOctet, Kind::kChar, Kind::kInt16, Kind::kUint16, Kind::kInt32, Kind::kUint32,
        Kind::kInt64, Kind::kUint64, Kind::kFloat32, Kind::kFloat64})
    members.push_back({"m" + std::to_string(members.size()), of(kind), members.empty()});
  const TypePtr choice = of(Type{.kind = Kind::kEnum, .name = "m::Choice", .literals = {{"A", 0}, {"B", 1}}});
  const TypePtr text = of(Type{.kind = Kind::kString, .bound = 8});
  members.push_back({"choice", choice, true});
  members.push_back({"text", text, true});
  members.push_back({"grid", many(Kind::kArray, many(Kind::kArray, of(Kind::kInt16), 2), 3)});
  const TypePtr point = of(
      Type{.kind = Kind::kStruct,
           .name = "m::Point",
           .members = {{"name", text}, {"x", of(Kind::kFloat64)}, {"tags", many(Kind::kSequence, text, 0)}}});
  members.push_back({"points", many(Kind::kSequence, point, 4)});
  members.push_back({"rows", many(Kind::kSequence, many(Kind::kSequence, of(Kind::kUint16), 0), 0)});
  members.push_back({"data", many(Kind::kSequence, of(Kind::kOctet), 0)});
  return of(Type{.kind = Kind::kStruct, .name = "m::EveryKind", .members = std::move(members)});
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  using namespace phantom::diagnostics;
  static const TypePtr type = every_kind();
  const std::vector<std::uint8_t> payload(bytes,
                                          bytes + size);  // of its exact size: a read beyond it is seen
  const auto sample = decode(*type, payload);
  if (!sample) {
    if (sample.status().message().empty()) std::abort();
    return 0;
  }
  if (to_line(*sample).empty() || to_text(*sample).empty() || instance_name(*type, *sample).empty())
    std::abort();
  return 0;
}
