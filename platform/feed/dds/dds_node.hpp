/// This process among the nodes of a ROS 2 domain: readers and writers of topics, as rmw makes them.
#pragma once

#include <dds/dds.h>

#include <string>

namespace roborun::feed {

/// One thread. Everything ends with it. Whatever throws, throws InputError.
class DdsNode {
 public:
  explicit DdsNode(int domain);
  ~DdsNode();
  DdsNode(const DdsNode&) = delete;
  DdsNode& operator=(const DdsNode&) = delete;

  /// `topic` by its ROS name. Hears publishers of every quality of service: best effort, volatile; the newest `depth` wait.
  [[nodiscard]] dds_entity_t reader(const std::string& topic, const dds_topic_descriptor_t& type, int depth);
  /// Heard by subscribers that are reliable or not; `is_latched`: who comes late gets the last message.
  [[nodiscard]] dds_entity_t writer(const std::string& topic, const dds_topic_descriptor_t& type,
                                    bool is_latched);
  /// Until a reader has something.
  void wait(std::int64_t most_ns);

 private:
  [[nodiscard]] dds_entity_t topic_of(const std::string& topic, const dds_topic_descriptor_t& type);

  dds_entity_t participant_{}, waitset_{};
};

}  // namespace roborun::feed
