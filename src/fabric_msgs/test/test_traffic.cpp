// SPDX-License-Identifier: BSD-3-Clause
#include <fabric_msgs/Heartbeat.h>
#include <gtest/gtest.h>
#include <ros/callback_queue.h>
#include <std_msgs/UInt32.h>

#include <fabric_msgs/traffic.hpp>
#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

namespace {

using fabric::msgs::Traffic;

std::uint32_t total(const std::vector<fabric_msgs::Progress>& entries) {
  std::uint32_t sum = 0;
  for (const auto& entry : entries) sum += entry.count;
  return sum;
}

ros::Subscriber watchBeats(ros::NodeHandle& node, const std::string& name,
                           const std::function<void(const fabric_msgs::Heartbeat&)>& seen) {
  const boost::function<void(const fabric_msgs::Heartbeat::ConstPtr&)> callback =
      [name, seen](const fabric_msgs::Heartbeat::ConstPtr& beat) {
        if (beat->node == name) seen(*beat);
      };
  return node.subscribe<fabric_msgs::Heartbeat>("heartbeat", 1000, callback);
}

void ignoreAnswer(const std_msgs::UInt32::ConstPtr&) {}

/// Runs callbacks until `condition` holds, at most 30 s of wall time.
template <class Condition>
bool spinUntil(Condition condition) {
  const ros::WallTime deadline = ros::WallTime::now() + ros::WallDuration(30.0);
  while (!condition() && ros::WallTime::now() < deadline) {
    ros::getGlobalCallbackQueue()->callAvailable(ros::WallDuration(0.05));
  }
  return condition();
}

TEST(Traffic, EveryBeatHasAtLeastOneAnswerForEachQuestionHandled) {
  ros::NodeHandle node;
  std::vector<fabric_msgs::Heartbeat> beats;
  const ros::Subscriber watch =
      watchBeats(node, "echo_cpp", [&](const auto& beat) { beats.push_back(beat); });
  Traffic traffic(node, "echo_cpp");
  const auto answer = traffic.advertise<std_msgs::UInt32>("answer_cpp");
  const ros::Subscriber sink = node.subscribe("answer_cpp", 1000, ignoreAnswer);
  const ros::Subscriber input =
      traffic.subscribe<std_msgs::UInt32>("question_cpp", [&](const std_msgs::UInt32& message) {
        answer.publish(message);
        if (message.data == 13) throw std::runtime_error("an unlucky message");
      });
  const ros::Publisher question = node.advertise<std_msgs::UInt32>("question_cpp", 1000);
  ASSERT_TRUE(spinUntil([&] { return question.getNumSubscribers() == 1 && !beats.empty(); }));
  for (std_msgs::UInt32 number; number.data < 50; ++number.data) question.publish(number);
  ASSERT_TRUE(spinUntil([&] { return total(beats.back().handled) == 50; }));
  EXPECT_EQ(total(beats.back().sent), 50U);
  EXPECT_EQ(beats.back().sent.front().connections, 1U);
  for (const auto& beat : beats) EXPECT_GE(total(beat.sent), total(beat.handled));
}

TEST(Traffic, ASequenceNumberSetsTheCount) {
  ros::NodeHandle node;
  fabric_msgs::Heartbeat last;
  const ros::Subscriber watch =
      watchBeats(node, "state_cpp", [&](const auto& beat) { last = beat; });
  Traffic traffic(node, "state_cpp");
  const auto state = traffic.advertise<std_msgs::UInt32>("state_cpp");
  state.publish(std_msgs::UInt32(), 7);
  state.repeat(std_msgs::UInt32());
  traffic.handled("other", 9);
  ASSERT_TRUE(spinUntil([&] { return total(last.handled) == 9 && total(last.sent) == 7; }));
}

TEST(Traffic, RefusesBadArguments) {
  const ros::NodeHandle node;
  EXPECT_THROW(Traffic(node, ""), std::invalid_argument);
  EXPECT_THROW(Traffic(node, "x", 0.0), std::invalid_argument);
}

}  // namespace

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  ros::init(argc, argv, "test_traffic");
  const ros::NodeHandle keep_alive;
  return RUN_ALL_TESTS();
}
