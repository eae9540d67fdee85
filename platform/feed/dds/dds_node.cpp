#include "platform/feed/dds/dds_node.hpp"

#include <fmt/format.h>

#include <array>
#include <memory>

#include "platform/input/input_error.hpp"

namespace roborun::feed {
namespace {

dds_entity_t checked(dds_entity_t entity, const std::string& what) {
  if (entity < 0) throw InputError(fmt::format("{}: Cyclone DDS: {}", what, dds_strretcode(-entity)));
  return entity;
}

struct DeleteQos {
  void operator()(dds_qos_t* qos) const { dds_delete_qos(qos); }
};
using Qos = std::unique_ptr<dds_qos_t, DeleteQos>;

Qos qos_of(dds_reliability_kind_t reliability, dds_durability_kind_t durability, std::int32_t depth) {
  Qos qos(dds_create_qos());
  dds_qset_reliability(qos.get(), reliability, DDS_MSECS(100));
  dds_qset_durability(qos.get(), durability);
  dds_qset_history(qos.get(), DDS_HISTORY_KEEP_LAST, depth);
  return qos;
}

}  // namespace

DdsNode::DdsNode(int domain)
    : participant_(checked(dds_create_participant(static_cast<dds_domainid_t>(domain), nullptr, nullptr),
                           fmt::format("--domain: {}", domain))),
      waitset_(checked(dds_create_waitset(participant_), "waitset")) {}

DdsNode::~DdsNode() { (void)dds_delete(participant_); }

dds_entity_t DdsNode::topic_of(const std::string& topic, const dds_topic_descriptor_t& type) {
  return checked(dds_create_topic(participant_, &type, ("rt" + topic).c_str(), nullptr, nullptr), topic);
}

dds_entity_t DdsNode::reader(const std::string& topic, const dds_topic_descriptor_t& type, int depth) {
  const Qos qos = qos_of(DDS_RELIABILITY_BEST_EFFORT, DDS_DURABILITY_VOLATILE, depth);
  const dds_entity_t reader =
      checked(dds_create_reader(participant_, topic_of(topic, type), qos.get(), nullptr), topic);
  const dds_entity_t condition = checked(dds_create_readcondition(reader, DDS_ANY_STATE), topic);
  (void)dds_waitset_attach(waitset_, condition, 0);
  return reader;
}

dds_entity_t DdsNode::writer(const std::string& topic, const dds_topic_descriptor_t& type, bool is_latched) {
  const Qos qos = qos_of(DDS_RELIABILITY_RELIABLE,
                         is_latched ? DDS_DURABILITY_TRANSIENT_LOCAL : DDS_DURABILITY_VOLATILE, 1);
  constexpr std::array<dds_data_representation_id_t, 1> kPlain{DDS_DATA_REPRESENTATION_XCDR1};
  dds_qset_data_representation(qos.get(), kPlain.size(), kPlain.data());
  return checked(dds_create_writer(participant_, topic_of(topic, type), qos.get(), nullptr), topic);
}

void DdsNode::wait(std::int64_t most_ns) { (void)dds_waitset_wait(waitset_, nullptr, 0, most_ns); }

}  // namespace roborun::feed
