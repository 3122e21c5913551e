#include "common/diagnostics/decode.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <random>

#include "common/diagnostics/tests/cdr_writer.hpp"

namespace phantom::diagnostics {
namespace {

using testing::HasSubstr;
using Json = nlohmann::ordered_json;

TypePtr of(Kind kind) { return std::make_shared<Type>(Type{.kind = kind}); }
TypePtr text(std::uint32_t bound = 0) {
  return std::make_shared<Type>(Type{.kind = Kind::kString, .bound = bound});
}
TypePtr sequence(TypePtr element, std::uint32_t bound = 0) {
  return std::make_shared<Type>(Type{.kind = Kind::kSequence, .element = std::move(element), .bound = bound});
}
TypePtr array(TypePtr element, std::uint32_t length) {
  return std::make_shared<Type>(Type{.kind = Kind::kArray, .element = std::move(element), .bound = length});
}
TypePtr structure(const std::string& name, std::vector<Member> members) {
  return std::make_shared<Type>(Type{.kind = Kind::kStruct, .name = name, .members = std::move(members)});
}
TypePtr colour() {
  return std::make_shared<Type>(
      Type{.kind = Kind::kEnum, .name = "m::Colour", .literals = {{"RED", 0}, {"GREEN", 1}}});
}

/// A type with everything in it: alignment gaps, an enum, nested sequences, octets.
TypePtr everything() {
  const auto point =
      structure("m::Point", {{"name", text(8)}, {"x", of(Kind::kFloat64)}, {"tags", sequence(text())}});
  return structure("m::Everything", {{"flag", of(Kind::kBoolean)},
                                     {"id", of(Kind::kUint16), true},
                                     {"colour", colour()},
                                     {"big", of(Kind::kUint64)},
                                     {"small", of(Kind::kInt16)},
                                     {"ratio", of(Kind::kFloat32)},
                                     {"rows", array(array(of(Kind::kInt32), 2), 2)},
                                     {"points", sequence(point, 4)},
                                     {"nested", sequence(sequence(of(Kind::kUint16)))},
                                     {"data", sequence(of(Kind::kOctet))}});
}

std::vector<std::uint8_t> everything_bytes(bool little_endian) {
  CdrWriter cdr(little_endian);
  cdr.put<std::uint8_t>(1).put<std::uint16_t>(513).put<std::uint32_t>(1);
  cdr.put<std::uint64_t>(std::numeric_limits<std::uint64_t>::max()).put<std::int16_t>(-2).put<float>(0.1F);
  for (const std::int32_t value : {1, -2, 3, -4}) cdr.put(value);
  cdr.put<std::uint32_t>(2);
  cdr.text("elbow").put<double>(0.25).put<std::uint32_t>(0);
  cdr.text("").put<double>(-1e300).put<std::uint32_t>(2).text("a").text("bc");
  cdr.put<std::uint32_t>(2)
      .put<std::uint32_t>(3)
      .put<std::uint16_t>(1)
      .put<std::uint16_t>(2)
      .put<std::uint16_t>(3)
      .put<std::uint32_t>(0);
  cdr.put<std::uint32_t>(3).put<std::uint8_t>(0xde).put<std::uint8_t>(0xad).put<std::uint8_t>(0x01);
  return cdr.bytes();
}

TEST(Decode, EveryKindComesBackFromEitherByteOrder) {
  const Json expected =
      Json::parse(R"({"flag":true,"id":513,"colour":"GREEN","big":18446744073709551615,"small":-2,"ratio":0.1,
    "rows":[[1,-2],[3,-4]],
    "points":[{"name":"elbow","x":0.25,"tags":[]},{"name":"","x":-1e300,"tags":["a","bc"]}],
    "nested":[[1,2,3],[]],"data":"dead01"})");
  for (const bool little_endian : {true, false}) {
    const auto sample = decode(*everything(), everything_bytes(little_endian));
    ASSERT_TRUE(sample) << sample.status().message();
    EXPECT_EQ(sample->dump(), expected.dump());
  }
}

TEST(Decode, WhatJsonHasNoNumberForIsAWord) {
  const auto type =
      structure("m::N", {{"a", of(Kind::kFloat64)}, {"b", of(Kind::kFloat64)}, {"c", of(Kind::kFloat32)}});
  const auto sample = decode(*type, CdrWriter()
                                        .put(std::nan(""))
                                        .put(-std::numeric_limits<double>::infinity())
                                        .put(std::numeric_limits<float>::infinity())
                                        .bytes());
  ASSERT_TRUE(sample);
  EXPECT_EQ(sample->dump(), R"({"a":"NaN","b":"-Infinity","c":"Infinity"})");
}

TEST(Decode, AnEnumValueWithoutALiteralSaysSo) {
  const auto type = structure("m::E", {{"colour", colour()}});
  const auto sample = decode(*type, CdrWriter().put<std::uint32_t>(17).bytes());
  ASSERT_TRUE(sample);
  EXPECT_EQ((*sample)["colour"], "17 (no literal of Colour)");
}

TEST(Decode, LongRunsOfOctetsAreCutUnlessAskedFor) {
  const auto type = structure("m::B", {{"data", sequence(of(Kind::kOctet))}});
  CdrWriter cdr;
  cdr.put<std::uint32_t>(40);
  for (int i = 0; i < 40; ++i) cdr.put<std::uint8_t>(0xab);
  EXPECT_EQ((*decode(*type, cdr.bytes(), {.most_octets = 2}))["data"], "abab… (40 octets)");
  EXPECT_EQ((*decode(*type, cdr.bytes(), {.most_octets = 0}))["data"].get<std::string>().size(), 80u);
}

TEST(Decode, TextThatIsNoUtf8StaysPrintable) {
  const auto type = structure("m::T", {{"name", text()}});
  const auto sample = decode(*type, CdrWriter().text("gr\xfc\xdf").bytes());
  ASSERT_TRUE(sample);
  EXPECT_EQ((*sample)["name"], "gr\uFFFD\uFFFD");
  EXPECT_NO_THROW(sample->dump());
}

TEST(Decode, TheInstanceIsNamedByItsKey) {
  const auto type = everything();
  EXPECT_EQ(instance_name(*type, *decode(*type, everything_bytes(true))), "id=513");
}

struct BadPayload {
  const char* name;
  std::vector<std::uint8_t> bytes;
  const char* message;
};

class DecodeBad : public testing::TestWithParam<BadPayload> {};

// Tries dds_spy: of another version of the type
TEST_P(DecodeBad, IsRefusedWithItsPlaceAndReason) {
  const auto type =
      structure("m::Bad", {{"flag", of(Kind::kBoolean)},
                           {"name", text(4)},
                           {"list", sequence(structure("m::P", {{"x", of(Kind::kFloat64)}}), 3)}});
  const auto sample = decode(*type, GetParam().bytes);
  ASSERT_FALSE(sample);
  EXPECT_THAT(sample.status().message(), HasSubstr(GetParam().message));
}

INSTANTIATE_TEST_SUITE_P(
    Payloads, DecodeBad,
    testing::Values(
        BadPayload{"empty", {}, "m::Bad: 0 octets: too short for the encapsulation header"},
        BadPayload{"xcdr2", {0, 7, 0, 0, 1}, "encapsulation 0x0007 is not plain CDR"},
        BadPayload{"nothing_follows", {0, 1, 0, 0}, "m::Bad.flag: needs 1 octets at 0, 0 are left"},
        BadPayload{"boolean", CdrWriter().put<std::uint8_t>(2).bytes(), "m::Bad.flag: a boolean of 2"},
        BadPayload{"string_longer_than_all",
                   CdrWriter().put<std::uint8_t>(1).put<std::uint32_t>(0xffffffff).bytes(),
                   "m::Bad.name: needs 4294967295 octets at 8, 0 are left"},
        BadPayload{"string_without_end",
                   CdrWriter()
                       .put<std::uint8_t>(1)
                       .put<std::uint32_t>(2)
                       .put<std::uint8_t>('a')
                       .put<std::uint8_t>('b')
                       .bytes(),
                   "m::Bad.name: a string that does not end with a zero"},
        BadPayload{"string_over_its_bound",
                   CdrWriter().put<std::uint8_t>(1).text("abcde").put<std::uint32_t>(0).bytes(),
                   "m::Bad.name: a string of 5 octets (allowed: 4)"},
        BadPayload{"sequence_over_its_bound",
                   CdrWriter().put<std::uint8_t>(1).text("a").put<std::uint32_t>(4).bytes(),
                   "m::Bad.list: a sequence of 4 elements (allowed: 3)"},
        BadPayload{"sequence_without_elements",
                   CdrWriter().put<std::uint8_t>(1).text("a").put<std::uint32_t>(2).put<double>(1).bytes(),
                   "m::Bad.list: claims 2 elements of at least 8 octets"},
        BadPayload{
            "more_members",
            CdrWriter().put<std::uint8_t>(1).text("a").put<std::uint32_t>(0).put<std::uint32_t>(0).bytes(),
            "4 octets follow the last member"}),
    [](const auto& tested) { return tested.param.name; });

// Cut anywhere and with any octet changed, a payload gives a sample or an error, and never reads beyond its
// end (the copy's exact size lets a sanitizer see that).
TEST(Decode, NoDamageIsFatal) {
  const auto type = everything();
  const auto whole = everything_bytes(true);
  for (std::size_t size = 0; size < whole.size(); ++size) {
    const std::vector<std::uint8_t> cut(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size));
    const auto sample = decode(*type, cut);
    ASSERT_FALSE(sample) << size;
    EXPECT_FALSE(sample.status().message().empty());
  }
  std::mt19937 random(7);
  for (int i = 0; i < 20'000; ++i) {
    auto damaged = whole;
    for (int changes = 0; changes < 3; ++changes)
      damaged[random() % damaged.size()] = static_cast<std::uint8_t>(random());
    const auto sample = decode(*type, damaged);
    if (sample) {
      EXPECT_NO_THROW(sample->dump());
    }
  }
}

TEST(Type, IsPrintedAsIdl) {
  EXPECT_EQ(idl_name(*sequence(text(8), 4)), "sequence<string<8>, 4>");
  EXPECT_EQ(idl_name(*array(array(of(Kind::kInt32), 2), 3)), "long[3][2]");
  EXPECT_EQ(idl_text(*structure("m::S", {{"c", colour(), true}, {"d", array(of(Kind::kFloat64), 16)}})),
            "enum m::Colour {\n  RED,  // 0\n  GREEN,  // 1\n};\nstruct m::S {\n  @key m::Colour c;\n  "
            "double d[16];\n};\n");
}

TEST(Type, TheLeastSizeOfASampleIsItsFixedPart) {
  EXPECT_EQ(least_size(*everything()), 1u + 2 + 4 + 8 + 2 + 4 + 16 + 4 + 4 + 4);
}

}  // namespace
}  // namespace phantom::diagnostics
