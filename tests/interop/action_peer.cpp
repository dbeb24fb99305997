// A roscpp node with the roles and the output of action_peer.py.
#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include <actionlib/TestAction.h>
#include <actionlib/client/simple_action_client.h>
#include <actionlib/server/simple_action_server.h>
#include <ros/ros.h>

namespace
{
using Client = actionlib::SimpleActionClient<actionlib::TestAction>;
using Server = actionlib::SimpleActionServer<actionlib::TestAction>;

const ros::Duration kSeconds(200.0);

void say(const std::string& line) { std::cout << line << std::endl; }

std::string yes(bool value) { return value ? "True" : "False"; }

void waitFor(const std::string& report, int goal)
{
  for (int found = 0; ros::ok() && !(ros::param::get(report, found) && found >= goal);)
  {
    ros::Duration(0.01).sleep();
  }
}

void serve()
{
  std::unique_ptr<Server> server;
  server.reset(new Server("interop_action", [&server](const actionlib::TestGoalConstPtr& goal) {
    actionlib::TestResult result;
    result.result = goal->goal % 10;
    if (result.result == 1)
    {
      waitFor("/sent", goal->goal);
      for (int number : {10, 11, 12})
      {
        actionlib::TestFeedback feedback;
        feedback.feedback = number;
        server->publishFeedback(feedback);
      }
      waitFor("/heard", goal->goal);
      server->setSucceeded(result, "reached");
    }
    else if (result.result == 2)
    {
      waitFor("/sent", goal->goal);
      server->setAborted(result, "failed");
    }
    else
    {
      while (!server->isPreemptRequested() && ros::ok())
      {
        ros::Duration(0.01).sleep();
      }
      server->setPreempted(result, "made way");
    }
  }, false));
  ros::AsyncSpinner spinner(2);
  spinner.start();
  server->start();
  say("ready");
  std::string line;
  while (std::getline(std::cin, line)) {}
  ros::shutdown();
}

struct Goal
{
  std::vector<int> feedback;
};

void ask()
{
  Client client("interop_action", true);
  say("server " + yes(client.waitForServer(kSeconds)));
  int tens = 0;
  auto numbered = [&tens](int kind) {
    actionlib::TestGoal message;
    message.goal = (tens += 10) + kind;
    // Nothing is lost of what comes while it is sent.
    ros::param::set("/sent", message.goal);
    return message;
  };
  auto send = [&client, &numbered](int kind) {
    auto goal = std::make_shared<Goal>();
    const actionlib::TestGoal message = numbered(kind);
    const int number = message.goal;
    client.sendGoal(
        message, Client::SimpleDoneCallback(), Client::SimpleActiveCallback(),
        [goal, number](const actionlib::TestFeedbackConstPtr& feedback) {
          goal->feedback.push_back(feedback->feedback);
          if (feedback->feedback == 12)
          {
            ros::param::set("/heard", number);
          }
        });
    return goal;
  };
  auto tell = [&client](const std::string& what, const std::shared_ptr<Goal>& goal) {
    const bool finished = client.waitForResult(kSeconds);
    const auto state = client.getState();
    say(what + " " + yes(finished) + " " + state.toString() + " " + state.getText() + " " +
        std::to_string(client.getResult()->result));
    std::string line = what + " feedback";
    for (int number : goal->feedback)
    {
      line += " " + std::to_string(number);
    }
    say(line);
  };
  auto untilActive = [&client]() {
    for (int i = 0; i < 20000 && client.getState() != actionlib::SimpleClientGoalState::ACTIVE; ++i)
    {
      ros::Duration(0.01).sleep();
    }
    say("state " + client.getState().toString());
  };

  auto goal = send(1);
  tell("succeeds", goal);
  goal = send(2);
  tell("aborts", goal);
  goal = send(3);
  untilActive();
  client.cancelGoal();
  tell("cancelled", goal);
  goal = send(3);
  untilActive();
  goal = send(1);
  tell("after another", goal);
  goal = send(3);
  untilActive();
  client.cancelAllGoals();
  tell("all cancelled", goal);
  goal = send(3);
  untilActive();
  client.cancelGoalsAtAndBeforeTime(ros::Time::now());
  tell("cancelled by time", goal);
  const std::string state = client.sendGoalAndWait(numbered(3), ros::Duration(0.3), kSeconds).toString();
  // Recalled where the cancel has overtaken the goal, which has another connection.
  say("out of time " + yes(state == "PREEMPTED" || state == "RECALLED"));
  say("in time " + client.sendGoalAndWait(numbered(2), kSeconds, ros::Duration(0)).toString());
}
}  // namespace

int main(int argc, char** argv)
{
  ros::init(argc, argv, "action_peer", ros::init_options::AnonymousName | ros::init_options::NoSigintHandler);
  ros::NodeHandle node;
  const std::string role = argc > 1 ? argv[1] : "";
  role == "serve" ? serve() : ask();
  return 0;
}
