// A participant of Fast DDS that prints a line for each participant that comes and goes, as `ros2` tools on
// rmw_fastrtps_cpp see them. Ends when its standard input does.
//
// g++ -std=c++17 -o fastdds_graph fastdds_graph.cpp -lfastrtps -lfastcdr

#include <cstdlib>
#include <iostream>

#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/domain/DomainParticipantListener.hpp>
#include <fastdds/rtps/participant/ParticipantDiscoveryInfo.h>
#include <fastrtps/utils/IPLocator.h>

using namespace eprosima::fastdds::dds;
using eprosima::fastrtps::rtps::IPLocator;
using eprosima::fastrtps::rtps::Locator_t;
using eprosima::fastrtps::rtps::ParticipantDiscoveryInfo;

class Graph : public DomainParticipantListener {
    void on_participant_discovery(DomainParticipant *, ParticipantDiscoveryInfo &&of) override {
        const char *what = "changed";
        switch (of.status) {
        case ParticipantDiscoveryInfo::DISCOVERED_PARTICIPANT: what = "found"; break;
        case ParticipantDiscoveryInfo::REMOVED_PARTICIPANT: what = "left"; break;
        case ParticipantDiscoveryInfo::DROPPED_PARTICIPANT: what = "lost"; break;
        default: break;
        }
        std::cout << what << " " << of.info.m_guid.guidPrefix << std::endl;
    }
};

int main(int, char **arguments) {
    const int domain = std::atoi(arguments[1]);
    DomainParticipantQos qos;
    // The participants of this computer, should its loopback device carry no multicast.
    for (int participant = 0; participant < 8; ++participant) {
        Locator_t locator;
        IPLocator::setIPv4(locator, 127, 0, 0, 1);
        locator.port = 7410 + 250 * domain + 2 * participant;
        qos.wire_protocol().builtin.initialPeersList.push_back(locator);
    }
    Graph graph;
    auto *factory = DomainParticipantFactory::get_instance();
    auto *participant = factory->create_participant(domain, qos, &graph, StatusMask::none());
    if (participant == nullptr) {
        return 1;
    }
    std::cout << "listening" << std::endl;
    while (std::cin.get() != EOF) {
    }
    factory->delete_participant(participant);
}
