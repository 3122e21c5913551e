#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace phantom::diagnostics {

struct Type;
using TypePtr = std::shared_ptr<const Type>;

enum class Kind {  // primitives first
  kBoolean,
  kOctet,
  kChar,
  kInt16,
  kUint16,
  kInt32,
  kUint32,
  kInt64,
  kUint64,
  kFloat32,
  kFloat64,
  kString,
  kEnum,
  kStruct,
  kSequence,
  kArray
};

struct Member {
  std::string name;
  TypePtr type;
  bool key = false;
};

struct Literal {
  std::string name;
  std::uint32_t value = 0;
};

/// A type of the IDL as a tree: sufficient to read its samples without generated code.
struct Type {
  Kind kind = Kind::kBoolean;
  std::string name;               ///< struct, enum: scoped name, "phantom::msg::Stamp"
  std::vector<Member> members;    ///< struct, in the order of the IDL
  std::vector<Literal> literals;  ///< enum
  TypePtr element;                ///< sequence, array
  std::uint32_t bound = 0;        ///< array: length; sequence, string: greatest length, 0: none
};

/// Returns the size of a primitive in CDR in octets, which is also its alignment; 4 for an enum; 0 for a type
/// that is not primitive.
std::size_t primitive_size(Kind kind);

/// Returns the smallest number of octets of a sample of the type in CDR, without alignment, to check a
/// claimed length against.
std::size_t least_size(const Type& type);

/// Returns the type as IDL writes it: "sequence<phantom::msg::Figure, 32>", "double[16]", "string<64>".
std::string idl_name(const Type& type);

/// Returns the struct with its members, preceded by every struct and enum that it uses, as IDL (with scoped
/// names instead of modules).
std::string idl_text(const Type& type);

}  // namespace phantom::diagnostics
