// One end of a bond, by Debian's bondcpp. Prints what happens; breaks it at "break".
#include <iostream>
#include <mutex>
#include <string>
#include <thread>

#include <bondcpp/bond.h>
#include <ros/ros.h>

std::mutex lock;

void say(const std::string& text)
{
  std::lock_guard<std::mutex> guard(lock);
  std::cout << text << std::endl;
}

int main(int argc, char** argv)
{
  ros::init(argc, argv, "bond", ros::init_options::AnonymousName | ros::init_options::NoSigintHandler);
  ros::NodeHandle node;
  ros::AsyncSpinner spinner(1);
  spinner.start();
  bond::Bond bond(argv[1], argv[2], [] { say("broken"); }, [] { say("formed"); });
  bond.setConnectTimeout(std::stod(argv[3]));
  bond.setHeartbeatTimeout(std::stod(argv[4]));
  bond.setHeartbeatPeriod(0.2);
  bond.setDisconnectTimeout(1.0);
  bond.start();
  std::thread([&] {
    bool broken = bond.waitUntilBroken(ros::WallDuration(300));
    say(std::string("waited ") + (broken ? "True" : "False") + (bond.isBroken() ? " True True" : " False False"));
  }).detach();
  std::string line;
  while (std::getline(std::cin, line))
  {
    if (line == "break")
      bond.breakBond();
    else if (line == "wait")
    {
      bool known = bond.waitUntilFormed(ros::WallDuration(200));
      // It notices silence only after the second heartbeat.
      for (int beats = 0; beats < 3;)
        beats += ros::topic::waitForMessage<bond::Status>(argv[1])->instance_id != bond.getInstanceId();
      say(known ? "known True" : "known False");
    }
  }
  std::_Exit(0);
}
