// Intended contact: permits, what the contacts says of them, and what the step makes of them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "components/phantom_sensing/contact_register.hpp"
#include "components/phantom_sensing/tests/rig.hpp"
#include "tests/support/heap_guard.hpp"

namespace phantom::phantom_sensing {
namespace {

using messages::SensingRequest;
using testing::HasSubstr;

TEST(ContactPermits, EndAtTheirTimeAndNotBefore) {
  ContactPermits permits;
  ASSERT_TRUE(permits.allow({3, 2, 1000}));
  ASSERT_TRUE(permits.allow({4}));
  EXPECT_TRUE(permits.at(999).mutes(2, 3));
  EXPECT_FALSE(permits.at(1000).mutes(2, 3));
  EXPECT_TRUE(permits.at(1'000'000'000'000).mutes(5, 4));
  EXPECT_TRUE(permits.take_ended(999).empty());
  ASSERT_EQ(permits.take_ended(1000).size(), 1U);
  EXPECT_EQ(permits.size(), 1U);
}

TEST(ContactPermits, AreRenewedNotDoubledAndBounded) {
  ContactPermits permits;
  for (int i = 0; i < 100; ++i) ASSERT_TRUE(permits.allow({3, 2, 1000 + i}));
  EXPECT_EQ(permits.size(), 1U);
  EXPECT_TRUE(permits.at(1098).mutes(2, 3));
  for (std::uint16_t i = 0; permits.size() < ContactPermits::kMax; ++i)
    ASSERT_TRUE(permits.allow({static_cast<std::uint16_t>(100 + i)}));
  EXPECT_FALSE(permits.allow({99}));
  EXPECT_TRUE(permits.forbid(3, 2));
  EXPECT_FALSE(permits.forbid(3, 2));
  EXPECT_TRUE(permits.allow({99}));
}

class Register : public testing::Test {
 protected:
  Register() { contacts_.know_objects({{1, "wall"}, {2, "vice"}}); }
  Answer request(bool allow, const std::string& object, const std::string& link = "",
                 double duration_s = 0.0) {
    return contacts_.handle(
        {.request = allow ? SensingRequest::kAllowContact : SensingRequest::kForbidContact,
         .object = object,
         .link = link,
         .duration_s = duration_s},
        5);
  }
  PhantomModel model_ = rig::suspended_model();
  ContactRegister contacts_{model_.arm};
};

TEST_F(Register, AllowsAndForbidsByNameOrId) {
  const std::string tip = model_.arm.links().back().name;
  const Answer answer = request(true, "vice", tip, 1.5);
  EXPECT_TRUE(answer.done);
  EXPECT_EQ(answer.message, "contact allowed: vice by " + tip + " for 1.5 s");
  EXPECT_TRUE(contacts_.permits().at(5).mutes(model_.arm.joint_count(), 2));
  EXPECT_FALSE(contacts_.permits().at(5).mutes(1, 2));
  EXPECT_FALSE(contacts_.permits().at(5 + core::from_seconds(1.5)).mutes(model_.arm.joint_count(), 2));
  EXPECT_TRUE(contacts_.handle({.request = SensingRequest::kAllowContact, .id = 7}, 5).done);
  EXPECT_TRUE(contacts_.permits().at(5).mutes(1, 7));
  EXPECT_TRUE(request(false, "vice", tip).done);
  EXPECT_THAT(request(false, "vice", tip).message, HasSubstr("not allowed before"));
  EXPECT_TRUE(contacts_.handle({.request = SensingRequest::kForbidContact}, 5).done);
  EXPECT_EQ(contacts_.permits().size(), 0U);
}

// Tries phantom_sensing: a command that cannot be carried out
TEST_F(Register, RefusesNamingWhatIsAllowed) {
  EXPECT_THAT(request(true, "vise").message, HasSubstr("no object is called 'vise'; allowed: wall, vice"));
  EXPECT_THAT(request(true, "vice", "tentacle").message, HasSubstr("no moving link called 'tentacle'"));
  EXPECT_EQ(contacts_.permits().size(), 0U);
}

TEST_F(Register, SaysWhatHasEnded) {
  request(true, "vice", "", 1.0);
  EXPECT_TRUE(contacts_.end_old(6).empty());
  const auto ended = contacts_.end_old(10 * core::kNsPerSecond);
  ASSERT_EQ(ended.size(), 1U);
  EXPECT_THAT(ended[0], HasSubstr("vice by the whole arm"));
}

class Muted : public testing::Test {
 protected:
  StepInputs near(const percept::AllowedContact& allowed) {
    StepInputs inputs = rig::hanging(0.25, 0.3);
    inputs.allowed = allowed;
    return inputs;
  }
  percept::AllowedContact wall_by(std::size_t link) {
    percept::AllowedContact allowed;
    allowed.add(1, link);
    return allowed;
  }
  PhantomModel model_ = rig::suspended_model();
  PhantomSensing sensing_{model_, {}};
  StepOutputs out_;
};

TEST_F(Muted, TheWholeArmFeelsNothingOfItAndIsNotWarned) {
  sensing_.step(near({}), out_);
  ASSERT_GT(out_.drag.plus[0], 0.0);
  ASSERT_FALSE(out_.alerts.raised.empty());
  const std::size_t felt = out_.active_sensors;
  PhantomSensing fresh(model_, {});
  fresh.step(near(wall_by(percept::AllowedContact::kWholeArm)), out_);
  EXPECT_TRUE(out_.valid);
  EXPECT_EQ(out_.muted_sensors, felt);
  EXPECT_EQ(out_.active_sensors, 0U);
  EXPECT_EQ(out_.percept.mu, 0.0);
  EXPECT_TRUE(out_.alerts.raised.empty());
  EXPECT_TRUE(out_.threats.empty());
  for (std::size_t j = 0; j < 7; ++j) EXPECT_EQ(out_.drag.plus[j], 0.0);
}

TEST_F(Muted, AnotherLinkStillFeelsIt) {
  sensing_.step(near({}), out_);
  const double all = out_.drag.plus[0];
  const std::size_t worst = out_.percept.link;
  PhantomSensing fresh(model_, {});
  fresh.step(near(wall_by(worst)), out_);
  EXPECT_GT(out_.muted_sensors, 0U);
  EXPECT_GT(out_.drag.plus[0], 0.0);
  EXPECT_LT(out_.drag.plus[0], all);
  EXPECT_NE(out_.percept.link, worst);
}

TEST_F(Muted, ComesBackWhenItIsOver) {
  sensing_.step(near({}), out_);
  const StepOutputs before = out_;
  sensing_.step(near(wall_by(percept::AllowedContact::kWholeArm)), out_);
  percept::AllowedContact other = wall_by(percept::AllowedContact::kWholeArm);
  other.add(1, 3);  // twice over, to be taken back once
  sensing_.step(near(other), out_);
  EXPECT_EQ(out_.drag.plus[0], 0.0);
  sensing_.step(near({}), out_);
  EXPECT_EQ(out_.drag.plus, before.drag.plus);
  EXPECT_EQ(out_.percept.mu, before.percept.mu);
  EXPECT_EQ(out_.muted_sensors, 0U);
}

TEST_F(Muted, OfAnotherObjectChangesNothing) {
  sensing_.step(near({}), out_);
  const StepOutputs before = out_;
  percept::AllowedContact allowed;
  allowed.add(9, percept::AllowedContact::kWholeArm);
  sensing_.step(near(allowed), out_);
  for (std::size_t j = 0; j < 7; ++j)
    EXPECT_NEAR(out_.drag.plus[j], before.drag.plus[j], 1e-9 * before.drag.plus[0]);
  EXPECT_EQ(out_.percept.sensor, before.percept.sensor);
  EXPECT_EQ(out_.percept.gradient.pgv_W_m, before.percept.gradient.pgv_W_m);
}

TEST_F(Muted, ChangingItUsesNoHeap) {
  StepInputs inputs = near({});
  const ::phantom::test::HeapGuard no_heap;
  for (std::size_t i = 0; i < 50; ++i) {
    inputs.allowed = wall_by(i % 8);
    sensing_.step(inputs, out_);
  }
}

}  // namespace
}  // namespace phantom::phantom_sensing
