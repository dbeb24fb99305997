# roscd, rosls, rosed, roscat, roscp, rosmv, rospd, rosd and TAB completion, for fish: to be sourced.
#
# What can be completed is known by `minirospy complete` alone; here is only what a program cannot do for its shell.
# The same as ros.bash, which says more. Source: http://wiki.ros.org/rosbash.

# --- where packages are

function _ros_find --argument-names package --description 'print the folder of a package, of logs, of results of tests'
    set --local home $HOME/.ros
    test -n "$ROS_HOME"; and set home $ROS_HOME
    switch $package
        case log
            test -n "$ROS_LOG_DIR"; and printf '%s\n' $ROS_LOG_DIR; or printf '%s\n' $home/log
        case test_results
            test -n "$ROS_TEST_RESULTS_DIR"; and printf '%s\n' $ROS_TEST_RESULTS_DIR; or printf '%s\n' $home/test_results
        case '*'
            # A metapackage is none to rospack.
            command rospack find $package; or command rosstack find $package 2>/dev/null
    end
end

function _ros_folder --argument-names name target --description 'print the folder PACKAGE[/FOLDER]; complain as command name'
    set --local parts (string split --max 1 / -- $target)
    test -n "$parts[1]"; or set parts $target
    set --local folder (_ros_find $parts[1] 2>/dev/null)
    if test -z "$folder"
        set --local complaint (_ros_find $parts[1] 2>&1 >/dev/null)
        # Before its error there may be warnings.
        printf '%s: ERROR: %s\n' $name (string replace --regex '^\[rospack\] Error: ' '' -- "$complaint[-1]") >&2
        return 1
    end
    test -n "$parts[2]"; and set folder $folder/$parts[2]
    printf '%s\n' $folder
end

function _ros_workspace --description 'print where roscd alone goes'
    if set --query ROS_WORKSPACE; and test -n "$ROS_WORKSPACE"
        printf '%s\n' $ROS_WORKSPACE
        return
    end
    # fish splits on import only variables whose names end in PATH: CMAKE_PREFIX_PATH is one.
    for prefix in (string split : -- $CMAKE_PREFIX_PATH)
        if test -f $prefix/.catkin -o -f $prefix/setup.bash -o -f $prefix/setup.fish
            printf '%s\n' $prefix
            return
        end
    end
    printf '%s\n' 'roscd: ERROR: no workspace: source its devel/setup.fish, or set ROS_WORKSPACE' >&2
    return 1
end

function _ros_usage --argument-names name --description 'print how a command is typed'
    printf 'usage: %s ' $name
    switch $name
        case roscd
            printf '%s\n' package '' 'Jump to target package.'
        case rosls
            printf '%s\n' 'package [options of ls]' '' 'Lists contents of a package directory.'
        case rosed
            printf '%s\n' 'package filename' '' 'Edit a file in a package, with the editor that EDITOR names.'
        case roscat
            printf '%s\n' 'package filename' '' 'Print a file of a package.'
        case rosmv
            printf '%s\n' 'package filename target' '   or: rosmv -d package target' '' 'Move a file of a package, or (-d) the package, to target.'
        case roscp
            printf '%s\n' 'package filename target' '' 'Copy a file from a package to target location.'
        case rospd
            printf '%s\n' '[package | number]' '' 'Like pushd, but with packages; a number turns the stack that rosd shows.'
    end
end

function _ros_takes --argument-names name least most --description 'check how many words a command was given; 1: say no more, 3: too few or many'
    set --local words $argv[4..]
    if test (count $words) -le 1; and contains -- "$words" -h --help
        _ros_usage $name
        return 1
    end
    test (count $words) -ge $least -a (count $words) -le $most; and return
    _ros_usage $name >&2
    return 3
end

# --- commands

function roscd --description 'go to the folder of a package'
    set --local folder
    _ros_takes roscd 0 1 $argv; or return (math $status - 1)
    if test -z "$argv"
        set folder (_ros_workspace); or return
    else
        set folder (_ros_folder roscd $argv); or return
    end
    if not test -d "$folder"
        printf '%s\n' "roscd: ERROR: folder $folder does not exist" >&2
        return 1
    end
    cd $folder
end

function rosls --description 'list the files of a package'
    if contains -- --help $argv
        _ros_usage rosls
        return
    end
    set --local flags (string match -- '-*' $argv)
    set --local packages (string match --invert -- '-*' $argv)
    if test (count $packages) -ne 1
        _ros_usage rosls >&2
        return 2
    end
    set --local folder (_ros_folder rosls $packages); or return
    ls $flags -- $folder
end

function _ros_file --argument-names name package file --description 'put the path of a file of a package into _ros_found; ask where many are'
    set --local folder (_ros_folder $name $package); or return
    if test -f $folder/$file
        set --global _ros_found $folder/$file
        return
    end
    set --local base (string split / -- $file)[-1]
    set --global _ros_found (find -L $folder -name '.?*' -prune -o -name __pycache__ -prune -o -type f -name $base -path "*/$file" -print 2>/dev/null | sort)
    switch (count $_ros_found)
        case 0
            printf '%s\n' "$name: ERROR: file $file does not exist in package [$package], which is in $folder" >&2
            return 1
        case 1
            return
    end
    printf '%s\n' 'You have chosen a non-unique filename, please pick one of the following:' >&2
    for number in (seq (count $_ros_found))
        printf '%s) %s\n' $number $_ros_found[$number] >&2
    end
    while read --prompt-str '#? ' --local answer
        if string match --quiet --regex '^[1-9][0-9]*$' -- $answer; and test $answer -le (count $_ros_found)
            set --global _ros_found $_ros_found[$answer]
            return
        end
    end
    return 1
end

function rosed --description 'edit a file of a package'
    _ros_takes rosed 2 2 $argv; or return (math $status - 1)
    _ros_file rosed $argv; or return
    for editor in "$EDITOR" "$VISUAL" nano vim vi emacs
        # EDITOR may hold options, as in "code --wait".
        set --local words (string split --no-empty ' ' -- $editor)
        if test -n "$editor"; and type --query $words[1]
            $words $_ros_found
            return
        end
    end
    printf '%s\n' 'rosed: ERROR: no editor is installed: set EDITOR to yours' >&2
    return 1
end

function roscp --description 'copy a file of a package'
    _ros_takes roscp 3 3 $argv; or return (math $status - 1)
    _ros_file roscp $argv[1] $argv[2]; or return
    cp -- $_ros_found $argv[3]
end

function roscat --description 'print a file of a package'
    _ros_takes roscat 2 2 $argv; or return (math $status - 1)
    _ros_file roscat $argv; or return
    cat -- $_ros_found
end

function rosmv --description 'move a file of a package, or the package'
    _ros_takes rosmv 3 3 $argv; or return (math $status - 1)
    if test "$argv[1]" = -d
        set --global _ros_found (_ros_folder rosmv $argv[2]); or return
    else
        _ros_file rosmv $argv[1] $argv[2]; or return
    end
    mv -- $_ros_found $argv[3]
end

function rosd --description 'show the stack of folders, numbered'
    set --local number 0
    for folder in $PWD $dirstack
        printf '%s %s\n' $number $folder
        set number (math $number + 1)
    end
end

function rospd --description 'push the folder of a package onto the stack, or turn the stack'
    _ros_takes rospd 0 1 $argv; or return (math $status - 1)
    if test -z "$argv"
        pushd $PWD >/dev/null; or return
    else if string match --quiet --regex '^\+?[0-9]+$' -- $argv
        set --local number (string replace + '' -- $argv)
        if test $number -gt (count $dirstack)
            printf '%s\n' "rospd: ERROR: the stack has no number $number: rosd shows it" >&2
            return 1
        end
        pushd +$number >/dev/null; or return
    else
        set --local folder (_ros_folder rospd $argv); or return
        pushd $folder >/dev/null; or return
    end
    rosd
end

# --- TAB

function _ros_complete --description 'print what can stand at the cursor'
    command --query minirospy; or return
    set --local before (commandline --tokenize --cut-at-cursor --current-process)
    set --local current (commandline --cut-at-cursor --current-token)
    # One line, as fish takes each line for a candidate; unquoted, as fish puts its own quotes around it.
    command minirospy complete --one-line (count $before) $before "$current" 2>/dev/null | string unescape
end

for name in roscd rospd rosls rosed roscat roscp rosmv minirospy rosrun roslaunch rostopic rosnode rosservice rosparam \
        rosmsg rossrv rosbag rosconsole rosgraph rosclean rosversion rospack rostest catkin_make roscore rosmaster \
        roslaunch-deps roslaunch-logs rosstack rosdep rosmsg-proto roswtf rqt rqt_bag rqt_console \
        rqt_controller_manager rqt_graph rqt_image_view rqt_joint_trajectory_controller rqt_launch rqt_logger_level \
        rqt_plot rqt_publisher rqt_reconfigure rqt_robot_monitor rqt_robot_steering rqt_runtime_monitor \
        rqt_service_caller rqt_tf_tree rqt_top rqt_topic rviz smach_viewer rosunit xacro check_urdf urdf_to_graphviz \
        urdf_to_graphiz catkin_test_results catkin_make_isolated catkin catkin_create_pkg catkin_init_workspace \
        catkin_find catkin_find_pkg catkin_topological_order
    complete --command $name --erase
    complete --command $name --no-files --arguments '(_ros_complete)'
end
