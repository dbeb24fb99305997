# roscd, rosls, rosed, roscat, roscp, rosmv, rospd, rosd and TAB completion, for bash and zsh: to be sourced.
#
# What can be completed is known by `minirospy complete` alone; here is only what a program cannot do for its shell:
# change its folder, and take part in its line editing. Source: http://wiki.ros.org/rosbash.
# shellcheck shell=bash

# --- where packages are

# _ros_find PACKAGE: print its folder, or that of logs, of results of tests; complain and fail where there is none.
_ros_find() {
    case $1 in
        log) printf '%s\n' "${ROS_LOG_DIR:-${ROS_HOME:-$HOME/.ros}/log}" ;;
        test_results) printf '%s\n' "${ROS_TEST_RESULTS_DIR:-${ROS_HOME:-$HOME/.ros}/test_results}" ;;
        # A metapackage is none to rospack.
        *) command rospack find "$1" || command rosstack find "$1" 2>/dev/null ;;
    esac
}

# _ros_folder COMMAND PACKAGE[/FOLDER]: print that folder; the complaint is COMMAND's.
_ros_folder() {
    local folder package complaint
    package=${2%%/*}
    [ -n "$package" ] || package=$2
    if ! folder=$(_ros_find "$package" 2>/dev/null) || [ -z "$folder" ]; then
        complaint=$(_ros_find "$package" 2>&1 >/dev/null)
        # Before its error there may be warnings.
        complaint=${complaint##*$'\n'}
        printf '%s: ERROR: %s\n' "$1" "${complaint#*rospack\] Error: }" >&2
        return 1
    fi
    # A Python of Windows ends its lines as Windows does.
    printf '%s\n' "${folder%$'\r'}${2#"$package"}"
}

# _ros_workspace: print where `roscd` alone goes.
_ros_workspace() {
    local rest prefix
    if [ -n "${ROS_WORKSPACE:-}" ]; then
        printf '%s\n' "$ROS_WORKSPACE"
        return
    fi
    rest=${CMAKE_PREFIX_PATH:-}
    while [ -n "$rest" ]; do
        prefix=${rest%%:*}
        rest=${rest#"$prefix"}
        rest=${rest#:}
        if [ -f "$prefix/.catkin" ] || [ -f "$prefix/setup.bash" ]; then
            printf '%s\n' "$prefix"
            return
        fi
    done
    printf '%s\n' 'roscd: ERROR: no workspace: source its devel/setup.bash, or set ROS_WORKSPACE' >&2
    return 1
}

# _ros_usage COMMAND [STATUS]: print how it is typed, on stderr where STATUS is not 0; return STATUS.
_ros_usage() {
    local text
    case $1 in
        roscd) text='package\n\nJump to target package.' ;;
        rosls) text='package [options of ls]\n\nLists contents of a package directory.' ;;
        rosed) text='package filename\n\nEdit a file in a package, with the editor that EDITOR names.' ;;
        roscat) text='package filename\n\nPrint a file of a package.' ;;
        rosmv) text='package filename target\n   or: rosmv -d package target\n\nMove a file of a package, or (-d) the package, to target.' ;;
        roscp) text='package filename target\n\nCopy a file from a package to target location.' ;;
        rospd) text='[package | number]\n\nLike pushd, but with packages; a number turns the stack that rosd shows.' ;;
    esac
    if [ "${2:-0}" -eq 0 ]; then
        printf 'usage: %s %b\n' "$1" "$text"
    else
        printf 'usage: %s %b\n' "$1" "$text" >&2
    fi
    return "${2:-0}"
}

# --- commands

roscd() {
    local folder
    case "${#}:${1:-}" in
        1:-h | 1:--help) _ros_usage roscd && return ;;
        0: | 1:) folder=$(_ros_workspace) || return ;;
        1:*) folder=$(_ros_folder roscd "$1") || return ;;
        *) _ros_usage roscd 2 || return ;;
    esac
    if [ ! -d "$folder" ]; then
        printf '%s\n' "roscd: ERROR: folder $folder does not exist" >&2
        return 1
    fi
    # `builtin`, so that a user's `cd` function does not interfere.
    builtin cd -- "$folder" || return
}

rosls() {
    local package='' folder word
    local -a flags
    flags=()
    for word in "$@"; do
        case $word in
            --help) _ros_usage rosls && return ;;
            -*) flags+=("$word") ;;
            *)
                [ -z "$package" ] || _ros_usage rosls 2 || return
                package=$word
                ;;
        esac
    done
    if [ -z "$package" ]; then
        _ros_usage rosls 2
        return
    fi
    folder=$(_ros_folder rosls "$package") || return
    ls ${flags[@]+"${flags[@]}"} -- "$folder"
}

# _ros_file COMMAND PACKAGE FILE: put the path of FILE, a path or a name in PACKAGE, into _ros_found; ask where many are.
_ros_file() {
    local folder file
    folder=$(_ros_folder "$1" "$2") || return
    _ros_found=()
    if [ -f "$folder/$3" ]; then
        _ros_found=("$folder/$3")
        return
    fi
    while IFS= read -r file; do
        _ros_found+=("$file")
    done < <(find -L "$folder" -name '.?*' -prune -o -name __pycache__ -prune -o -type f -name "${3##*/}" -path "*/$3" -print 2>/dev/null | sort)
    case ${#_ros_found[@]} in
        0)
            printf '%s\n' "$1: ERROR: file $3 does not exist in package [$2], which is in $folder" >&2
            return 1
            ;;
        1) return ;;
    esac
    printf '%s\n' 'You have chosen a non-unique filename, please pick one of the following:' >&2
    select file in "${_ros_found[@]}"; do
        if [ -n "$file" ]; then
            _ros_found=("$file")
            return
        fi
    done
    return 1
}

rosed() {
    local editor
    local -a _ros_found
    case "${#}:${1:-}" in
        1:-h | 1:--help) _ros_usage rosed && return ;;
        2:*) ;;
        *) _ros_usage rosed 2 || return ;;
    esac
    _ros_file rosed "$1" "$2" || return
    for editor in "${EDITOR:-}" "${VISUAL:-}" nano vim vi emacs; do
        if [ -n "$editor" ] && command -v "${editor%% *}" >/dev/null 2>&1; then
            # As git does it: EDITOR may hold options, as in "code --wait".
            eval "$editor \"\${_ros_found[@]}\""
            return
        fi
    done
    printf '%s\n' 'rosed: ERROR: no editor is installed: set EDITOR to yours' >&2
    return 1
}

roscp() {
    local -a _ros_found
    case "${#}:${1:-}" in
        1:-h | 1:--help) _ros_usage roscp && return ;;
        3:*) ;;
        *) _ros_usage roscp 2 || return ;;
    esac
    _ros_file roscp "$1" "$2" || return
    cp -- "${_ros_found[@]}" "$3"
}

roscat() {
    local -a _ros_found
    case "${#}:${1:-}" in
        1:-h | 1:--help) _ros_usage roscat && return ;;
        2:*) ;;
        *) _ros_usage roscat 2 || return ;;
    esac
    _ros_file roscat "$1" "$2" || return
    cat -- "${_ros_found[@]}"
}

rosmv() {
    local -a _ros_found
    case "${#}:${1:-}" in
        1:-h | 1:--help) _ros_usage rosmv && return ;;
        3:-d) _ros_found=("$(_ros_folder rosmv "$2")") || return ;;
        3:*) _ros_file rosmv "$1" "$2" || return ;;
        *) _ros_usage rosmv 2 || return ;;
    esac
    mv -- "${_ros_found[@]}" "$3"
}

# rosd: the stack of folders, numbered.
rosd() {
    local number=0 folder
    while IFS= read -r folder; do
        printf '%s %s\n' "$number" "$folder"
        number=$((number + 1))
    done < <(dirs -l -p)
}

# rospd [PACKAGE[/FOLDER] | NUMBER]: push a package's folder onto the stack, or turn the stack to a number of it.
rospd() {
    local folder
    case "${#}:${1:-}" in
        1:-h | 1:--help) _ros_usage rospd && return ;;
        0: | 1:) builtin pushd "$PWD" >/dev/null || return ;;
        1:[0-9] | 1:[0-9][0-9] | 1:+[0-9] | 1:+[0-9][0-9]) 
            if ! builtin pushd "+${1#+}" >/dev/null 2>&1; then
                printf '%s\n' "rospd: ERROR: the stack has no number ${1#+}: rosd shows it" >&2
                return 1
            fi
            ;;
        1:*)
            folder=$(_ros_folder rospd "$1") || return
            builtin pushd "$folder" >/dev/null || return
            ;;
        *) _ros_usage rospd 2 || return ;;
    esac
    rosd
}

# --- TAB

# _ros_candidates INDEX WORD...: put what can stand at WORD number INDEX into _ros_found.
_ros_candidates() {
    local into=-a vertical_tab=$'\v' line_feed=$'\n' return=$'\r'
    [ -z "${ZSH_VERSION:-}" ] || into=-A
    _ros_found=()
    # Thousands of candidates in one step: a loop over them would take longer than to find them.
    IFS=$'\n' read -r -d '' "$into" _ros_found < <(command minirospy complete "$@" 2>/dev/null) || :
    # zsh reads nothing as one empty candidate, which would take the place of the word.
    [ -n "${_ros_found[*]-}" ] || { _ros_found=(); return 0; }
    _ros_found=("${_ros_found[@]%"$return"}")
    _ros_found=("${_ros_found[@]//$vertical_tab/$line_feed}")
}

# _ros_complete_bash: what readline calls; COMP_* in, COMPREPLY out.
_ros_complete_bash() {
    local line="${COMP_LINE:0:COMP_POINT}" word='' fragment='' gap cut end=''
    local -a words _ros_found
    words=()
    # bash takes words apart at = and : as in `rate:=5`; what has no space in between belongs together.
    for fragment in "${COMP_WORDS[@]:0:COMP_CWORD+1}"; do
        gap=${line%%[![:space:]]*}
        line=${line#"$gap"}
        # The cursor may stand inside a word: what is behind it does not count.
        [ ${#line} -ge ${#fragment} ] || fragment=$line
        if [ ${#words[@]} -gt 0 ] && [ -z "$gap" ] && [ -n "$word" ]; then
            word=$word$fragment
            words[${#words[@]}-1]=$word
        else
            word=$fragment
            words+=("$word")
        fi
        line=${line#"$fragment"}
    done
    _ros_candidates "$((${#words[@]} - 1))" "${words[@]}"
    # readline puts a candidate in place of the last fragment: behind a = or :, and behind a quote, which it closes.
    cut=${word%"$fragment"}
    [ "$COMP_POINT" -lt "${#COMP_LINE}" ] || end=' '
    case $fragment in
        [\"\']*) cut=$cut${fragment%"${fragment#?}"} end='' ;;
        *[!:=]*) ;;
        *) cut=$word ;;
    esac
    COMPREPLY=()
    [ ${#_ros_found[@]} -gt 0 ] || return 0
    COMPREPLY=("${_ros_found[@]#"$cut"}")
    COMPREPLY=("${COMPREPLY[@]/%/$end}")
    # No space behind what goes on.
    COMPREPLY=("${COMPREPLY[@]/%\/ //}")
    COMPREPLY=("${COMPREPLY[@]/%= /=}")
}

# _ros_complete_zsh: what zsh's completion system calls; words and CURRENT in, compadd out.
_ros_complete_zsh() {
    local candidate word=${words[CURRENT]} quote=''
    local -a _ros_found ready partial end
    # The cursor may stand inside a word: what is behind it does not count.
    word=${word%"${SUFFIX:-}"}
    _ros_candidates "$((CURRENT - 1))" "${words[@]:0:$((CURRENT - 1))}" "$word"
    case $word in [\"\']*) quote=${word%"${word#?}"} ;; esac
    for candidate in ${_ros_found[@]+"${_ros_found[@]}"}; do
        # zsh keeps a quote that it has found open to itself, and closes it.
        candidate=${candidate#"$quote"}
        candidate=${candidate%"$quote"}
        case $candidate in
            */ | *=) partial+=("$candidate") ;;
            *) ready+=("$candidate") ;;
        esac
    done
    # -U: zsh would compare as it writes itself, and a[0] is not a\[0\] then.
    compadd -U -Q -S '' -a partial
    case ${RBUFFER:-} in ' '*) end=(-S '') ;; esac
    compadd -U -Q ${end[@]+"${end[@]}"} -a ready
}

_ros_commands() {
    printf '%s\n' roscd rospd rosls rosed roscat roscp rosmv minirospy rosrun roslaunch rostopic rosnode rosservice rosparam \
        rosmsg rossrv rosbag rosconsole rosgraph rosclean rosversion rospack rostest catkin_make roscore rosmaster \
        roslaunch-deps roslaunch-logs rosstack rosdep rosmsg-proto roswtf rqt rqt_bag rqt_console \
        rqt_controller_manager rqt_graph rqt_image_view rqt_joint_trajectory_controller rqt_launch rqt_logger_level \
        rqt_plot rqt_publisher rqt_reconfigure rqt_robot_monitor rqt_robot_steering rqt_runtime_monitor \
        rqt_service_caller rqt_tf_tree rqt_top rqt_topic rviz smach_viewer rosunit xacro check_urdf urdf_to_graphviz \
        urdf_to_graphiz catkin_test_results catkin_make_isolated catkin catkin_create_pkg catkin_init_workspace \
        catkin_find catkin_find_pkg catkin_topological_order
}

if [ -n "${ZSH_VERSION:-}" ]; then
    if ! type compdef >/dev/null 2>&1; then
        # A zsh without a .zshrc has no completion system yet. -u: ask no question about folders' owners.
        autoload -Uz compinit && compinit -u
    fi
    for _ros_command in $(_ros_commands); do compdef _ros_complete_zsh "$_ros_command"; done
elif type complete >/dev/null 2>&1; then
    # shellcheck disable=SC2046 # they are many words
    complete -o nospace -F _ros_complete_bash $(_ros_commands)
fi
unset _ros_command
