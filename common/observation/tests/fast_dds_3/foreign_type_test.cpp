// Types that are not the project's, which their owners describe.
#include <gtest/gtest.h>

#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/xtypes/dynamic_types/DynamicPubSubType.hpp>
#include <fastdds/dds/xtypes/dynamic_types/DynamicType.hpp>
#include <fastdds/dds/xtypes/dynamic_types/DynamicTypeBuilder.hpp>
#include <fastdds/dds/xtypes/dynamic_types/DynamicTypeBuilderFactory.hpp>
#include <fastdds/dds/xtypes/type_representation/ITypeObjectRegistry.hpp>
#include <mutex>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "common/dds/tests/test_network.hpp"
#include "common/diagnostics/decode.hpp"
#include "common/observation/learn_type.hpp"
#include "common/observation/observer.hpp"
#include "common/observation/payload_reader.hpp"
#include "common/observation/type_catalogue.hpp"
#include "flaskTypeObjectSupport.hpp"
#include "tests/support/child_process.hpp"

namespace phantom::observation {
namespace {

namespace edds = eprosima::fastdds::dds;

struct Flasks : DiscoveryListener, PayloadListener {
  void on_participant(const diagnostics::ParticipantInfo&, Presence) override {}
  void on_endpoint(const diagnostics::EndpointInfo& endpoint, Presence) override {
    const std::lock_guard lock(mutex);
    if (endpoint.writer && endpoint.topic == "flask") type = endpoint.type;
  }
  void on_payload(const Payload& payload) override {
    const std::lock_guard lock(mutex);
    bytes.assign(payload.bytes.begin(), payload.bytes.end());
  }
  std::string found() {
    const std::lock_guard lock(mutex);
    return type;
  }
  std::vector<std::uint8_t> received() {
    const std::lock_guard lock(mutex);
    return bytes;
  }
  std::mutex mutex;
  std::string type;
  std::vector<std::uint8_t> bytes;
};

class ForeignType : public testing::Test {
 protected:
  test::Process owner_{{PHANTOM_FOREIGN_OWNER, std::to_string(dds::test_network().domain)},
                       test::new_folder() / "foreign_owner.log"};
};

TEST_F(ForeignType, IsNotAskedForUnlessToldTo) {
  Flasks flasks;
  const Observer observer("observer", dds::test_network(), flasks);
  ASSERT_TRUE(dds::eventually([&] { return flasks.found() == "acme::Flask"; })) << flasks.found();
  EXPECT_FALSE(type_of("acme::Flask"));
}

TEST_F(ForeignType, IsDecodedByTheDescriptionThatItsOwnerGives) {
  Flasks flasks;
  Observer observer("observer", dds::test_network(), flasks, true);
  ASSERT_TRUE(dds::eventually([&] { return flasks.found() == "acme::Flask"; })) << flasks.found();
  const auto type = type_of("acme::Flask");
  ASSERT_TRUE(type);
  EXPECT_EQ(diagnostics::idl_text(*type), R"(enum acme::Lid {
  SHUT,  // 0
  OPEN,  // 1
};
struct acme::Point {
  double x;
  double y;
};
struct acme::Flask {
  @key string<16> label;
  acme::Lid lid;
  acme::Point corners[2][1];
  sequence<acme::Point> path;
  unsigned short count;
  boolean full;
};
)");
  const PayloadReader reader(observer.participant(), {"flask", "acme::Flask", true}, {}, flasks);
  ASSERT_TRUE(dds::eventually([&] { return !flasks.received().empty(); }));
  const auto json = diagnostics::decode(*type, flasks.received());
  ASSERT_TRUE(json) << json.status().message();
  EXPECT_EQ(json->dump(),
            R"({"label":"F-7","lid":"OPEN","corners":[[{"x":-1.0,"y":0.25}],[{"x":7.0,"y":8.0}]],)"
            R"("path":[{"x":1.0,"y":2.0},{"x":3.0,"y":4.0},{"x":5.0,"y":6.5}],"count":65535,"full":true})");
}

edds::xtypes::TypeIdentifier described(const edds::DynamicType::_ref_type& type) {
  edds::xtypes::TypeInformation information;
  edds::DynamicPubSubType support(type);
  support.register_type_object_representation();
  auto& registry = edds::DomainParticipantFactory::get_instance()->type_object_registry();
  registry.get_type_information(support.type_identifiers(), information);
  return information.complete().typeid_with_size().type_id();
}

// What learn_type() logs of a type with that function of flask.idl's; empty: it is known now.
template <class Register>
std::string learned(const std::string& name, Register register_type) {
  edds::xtypes::TypeIdentifierPair ids;
  register_type(ids);
  const auto complete = ids.type_identifier1()._d() == edds::xtypes::EK_COMPLETE ? ids.type_identifier1()
                                                                                 : ids.type_identifier2();
  testing::internal::CaptureStdout();
  learn_type(name, complete);
  const std::string said = testing::internal::GetCapturedStdout();
  EXPECT_EQ(said.empty(), type_of(name) != nullptr);
  return said;
}

TEST(LearnType, RefusesInWordsWhatIsNotDecoded) {
  EXPECT_EQ(learned("acme::Point", acme::register_Point_type_identifier), "");
  EXPECT_NE(learned("acme::WithOptional", acme::register_WithOptional_type_identifier)
                .find("optional members are not decoded"),
            std::string::npos);
  EXPECT_NE(learned("acme::TooLarge", acme::register_TooLarge_type_identifier).find("more than 2^24"),
            std::string::npos);
  EXPECT_NE(learned("acme::WithUnion", acme::register_WithUnion_type_identifier).find("not decoded"),
            std::string::npos);
}

edds::DynamicTypeBuilder::_ref_type struct_named(const std::string& name) {
  auto descriptor = edds::traits<edds::TypeDescriptor>::make_shared();
  descriptor->kind(edds::TK_STRUCTURE);
  descriptor->name(name);
  return edds::DynamicTypeBuilderFactory::get_instance()->create_type(descriptor);
}

edds::DynamicType::_ref_type struct_of(const std::string& name, const std::string& member,
                                       const edds::DynamicType::_ref_type& type) {
  auto builder = struct_named(name);
  auto descriptor = edds::traits<edds::MemberDescriptor>::make_shared();
  descriptor->name(member);
  descriptor->type(type);
  builder->add_member(descriptor);
  return builder->build();
}

TEST(LearnType, RefusesWhatAStrangerMightDescribe) {
  const auto octet = edds::DynamicTypeBuilderFactory::get_instance()->get_primitive_type(edds::TK_BYTE);
  learn_type("evil::Name", described(struct_of("evil::Name", "\x1b[2Jwiped", octet)));
  EXPECT_FALSE(type_of("evil::Name"));
  learn_type("evil::Empty", described(struct_named("evil::Empty")->build()));
  EXPECT_FALSE(type_of("evil::Empty"));
  auto deep = octet;
  for (int i = 0; i < 40; ++i) deep = struct_of("evil::Deep" + std::to_string(i), "inner", deep);
  learn_type("evil::Deep39", described(deep));
  EXPECT_FALSE(type_of("evil::Deep39"));
}

TEST(LearnType, NeverReplacesATypeOfTheProject) {
  const auto octet = edds::DynamicTypeBuilderFactory::get_instance()->get_primitive_type(edds::TK_BYTE);
  learn_type("phantom::msg::Percept", described(struct_of("phantom::msg::Percept", "fake", octet)));
  EXPECT_GT(type_of("phantom::msg::Percept")->members.size(), 5U);
}

}  // namespace
}  // namespace phantom::observation
