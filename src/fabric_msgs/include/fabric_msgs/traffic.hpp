// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fabric_msgs/Heartbeat.h>
#include <fabric_msgs/Progress.h>
#include <ros/ros.h>

#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace fabric::msgs {

/// Traffic counter and heartbeat of one C++ node.
///
/// The simulated cell holds its clock until every counted message sent has been handled. That
/// rests on one promise: a heartbeat never claims that a message was handled before everything
/// the message caused was sent and counted. So outputs are counted before they leave, and an input
/// when its callback has returned.
///
/// The 10 Hz heartbeat runs on a steady timer (also while /clock stands still) in the callback
/// queue of the given node handle: a node that hangs in a callback falls silent.
class Traffic {
 public:
  using Connections = std::function<std::uint32_t()>;

  static constexpr std::uint32_t QUEUE_SIZE = 1000;  // a counted message must not be dropped

  /// A publisher whose messages are counted before they leave.
  class Publisher {
   public:
    Publisher() = default;
    Publisher(Traffic* traffic, ros::Publisher publisher, std::string topic)
        : traffic_(traffic), publisher_(std::move(publisher)), topic_(std::move(topic)) {}

    /// Counts and sends one message.
    template <class M>
    void publish(const M& message) const {
      const std::lock_guard<std::recursive_mutex> lock(traffic_->mutex_);
      traffic_->sent(topic_);
      publisher_.publish(message);
    }

    /// Sends a message with its own sequence number: the count is set to it.
    template <class M>
    void publish(const M& message, std::uint32_t sequence) const {
      const std::lock_guard<std::recursive_mutex> lock(traffic_->mutex_);
      traffic_->sent(topic_, sequence);
      publisher_.publish(message);
    }

    /// Sends a message that repeats a counted one; it is not counted again.
    template <class M>
    void repeat(const M& message) const {
      publisher_.publish(message);
    }

    /// Subscribers connected now.
    [[nodiscard]] std::uint32_t connections() const { return publisher_.getNumSubscribers(); }

   private:
    Traffic* traffic_ = nullptr;
    ros::Publisher publisher_;
    std::string topic_;
  };

  /// Starts the heartbeat of `node_name` every `period` seconds of steady time.
  /// @throw std::invalid_argument when the name is empty or the period is not positive
  Traffic(const ros::NodeHandle& node, std::string node_name, double period = 0.1)
      : node_(node), node_name_(std::move(node_name)) {
    if (node_name_.empty()) throw std::invalid_argument("node_name is empty");
    if (!(period > 0.0)) throw std::invalid_argument("period of the heartbeat must be positive");
    heartbeat_ = node_.advertise<fabric_msgs::Heartbeat>("heartbeat", QUEUE_SIZE);
    timer_ = node_.createSteadyTimer(ros::WallDuration(period),
                                     [this](const ros::SteadyTimerEvent&) { beat(); });
  }
  Traffic(const Traffic&) = delete;
  Traffic& operator=(const Traffic&) = delete;

  /// Advertises `topic` and lists it among the counted outputs.
  template <class M>
  Publisher advertise(const std::string& topic, bool latch = false) {
    ros::Publisher publisher = node_.advertise<M>(topic, QUEUE_SIZE, latch);
    declareSent(topic, [publisher] { return publisher.getNumSubscribers(); });
    return Publisher(this, publisher, topic);
  }

  /// Subscribes to a counted topic: the message counts as handled when `callback` returns. An
  /// exception is logged and the message counts as handled too: a node does not die from a
  /// message, and nobody waits for ever for it.
  template <class M>
  ros::Subscriber subscribe(const std::string& topic, std::function<void(const M&)> callback) {
    declareHandled(topic);
    const boost::function<void(const boost::shared_ptr<M const>&)> handle =
        [this, topic, callback = std::move(callback)](const boost::shared_ptr<M const>& message) {
          const std::lock_guard<std::recursive_mutex> lock(mutex_);
          try {
            callback(*message);
          } catch (const std::exception& error) {
            ROS_ERROR_STREAM_THROTTLE(1.0, node_name_ << ": " << topic << ": " << error.what());
          }
          handled(topic);
        };
    return node_.subscribe<M>(topic, QUEUE_SIZE, handle, ros::VoidConstPtr(),
                              ros::TransportHints().tcpNoDelay());
  }

  /// Lists an input that is counted by hand with handled(), such as results of an action.
  void declareHandled(const std::string& topic) {
    const std::lock_guard<std::recursive_mutex> lock(mutex_);
    handled_.emplace(topic, 0);
  }

  /// Lists an output that is counted by hand with sent(), such as goals of an action.
  void declareSent(const std::string& topic, Connections connections) {
    const std::lock_guard<std::recursive_mutex> lock(mutex_);
    sent_.emplace(topic, 0);
    connections_[topic] = std::move(connections);
  }

  /// Counts a message that is about to be sent.
  void sent(const std::string& topic) {
    const std::lock_guard<std::recursive_mutex> lock(mutex_);
    ++sent_[topic];
  }

  /// Sets the count of an output to the sequence number of the message that is about to be sent.
  void sent(const std::string& topic, std::uint32_t sequence) {
    const std::lock_guard<std::recursive_mutex> lock(mutex_);
    sent_[topic] = sequence;
  }

  /// Counts a message as dealt with and sends a heartbeat. Call it when everything the message
  /// caused has been sent.
  void handled(const std::string& topic) {
    const std::lock_guard<std::recursive_mutex> lock(mutex_);
    ++handled_[topic];
    beat();
  }

  /// As handled(topic), with the count set to the message's own sequence number.
  void handled(const std::string& topic, std::uint32_t sequence) {
    const std::lock_guard<std::recursive_mutex> lock(mutex_);
    handled_[topic] = sequence;
    beat();
  }

 private:
  static fabric_msgs::Progress entry(const std::string& topic, std::uint32_t count,
                                     std::uint32_t connections) {
    fabric_msgs::Progress progress;
    progress.topic = topic;
    progress.count = count;
    progress.connections = connections;
    return progress;
  }

  void beat() {
    const std::lock_guard<std::recursive_mutex> lock(mutex_);
    fabric_msgs::Heartbeat message;
    message.header.stamp = ros::Time::now();
    message.node = node_name_;
    for (const auto& [topic, count] : handled_) message.handled.push_back(entry(topic, count, 0));
    for (const auto& [topic, count] : sent_) {
      const auto connections = connections_.find(topic);
      message.sent.push_back(
          entry(topic, count, connections == connections_.end() ? 0 : connections->second()));
    }
    heartbeat_.publish(message);
  }

  ros::NodeHandle node_;
  std::string node_name_;
  std::recursive_mutex mutex_;
  std::map<std::string, std::uint32_t> handled_;
  std::map<std::string, std::uint32_t> sent_;
  std::map<std::string, Connections> connections_;
  ros::Publisher heartbeat_;
  ros::SteadyTimer timer_;
};

}  // namespace fabric::msgs
