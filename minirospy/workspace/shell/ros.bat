@rem roscd, rosls, rosed, roscat, roscp, rosmv, rospd and rosd for cmd.exe: `call ros.bat` once in a window.
@rem Each becomes a doskey macro, which calls this file with its name: a called file may change the window's folder.
@if not "%~1"=="" goto %~1
@doskey roscd=call "%~f0" roscd $* 2>nul
@doskey rosls=call "%~f0" rosls $* 2>nul
@doskey rosed=call "%~f0" rosed $* 2>nul
@doskey roscat=call "%~f0" roscat $* 2>nul
@doskey rosmv=call "%~f0" rosmv $* 2>nul
@doskey roscp=call "%~f0" roscp $* 2>nul
@doskey rospd=call "%~f0" rospd $* 2>nul
@doskey rosd=pushd 2>nul
@exit /b 0

:roscd
@if "%~2"=="" goto workspace
@call :find "%~2" || exit /b 1
@cd /d "%ROS_FOUND%"
@exit /b

:workspace
@if not "%ROS_WORKSPACE%"=="" cd /d "%ROS_WORKSPACE%" & exit /b
@for /f "tokens=1 delims=;" %%p in ("%CMAKE_PREFIX_PATH%") do @cd /d "%%p" & exit /b
@>&2 echo roscd: ERROR: no workspace: call its devel\setup.bat, or set ROS_WORKSPACE
@exit /b 1

:rosls
@if "%~2"=="" >&2 echo usage: rosls package [options of dir]& exit /b 2
@call :find "%~2" || exit /b 1
@dir %3 %4 %5 "%ROS_FOUND%"
@exit /b

:rosed
@if "%~3"=="" >&2 echo usage: rosed package filename& exit /b 2
@call :find "%~2" || exit /b 1
@call :file "%~3" || exit /b 1
@if "%EDITOR%"=="" (notepad "%ROS_FOUND%") else %EDITOR% "%ROS_FOUND%"
@exit /b

:roscat
@if "%~3"=="" >&2 echo usage: roscat package filename& exit /b 2
@call :find "%~2" || exit /b 1
@call :file "%~3" || exit /b 1
@type "%ROS_FOUND%"
@exit /b

:rosmv
@if "%~4"=="" >&2 echo usage: rosmv package filename target& exit /b 2
@call :find "%~2" || exit /b 1
@call :file "%~3" || exit /b 1
@move "%ROS_FOUND%" "%~4"
@exit /b

:roscp
@if "%~4"=="" >&2 echo usage: roscp package filename target& exit /b 2
@call :find "%~2" || exit /b 1
@call :file "%~3" || exit /b 1
@copy "%ROS_FOUND%" "%~4"
@exit /b

:rospd
@if "%~2"=="" pushd . & exit /b
@call :find "%~2" || exit /b 1
@pushd "%ROS_FOUND%"
@exit /b

@rem The folder of PACKAGE[/FOLDER] goes into ROS_FOUND; rospack says itself what is wrong.
:find
@set ROS_FOUND=
@for /f "tokens=1* delims=/\" %%a in ("%~1") do @for /f "usebackq delims=" %%f in (`rospack find %%a`) do @set "ROS_FOUND=%%f\%%b"
@if "%ROS_FOUND%"=="" exit /b 1
@exit /b 0

@rem The first file of that name at or below ROS_FOUND takes its place.
:file
@if exist "%ROS_FOUND%%~1" set "ROS_FOUND=%ROS_FOUND%%~1" & exit /b 0
@for /f "delims=" %%f in ('dir /s /b "%ROS_FOUND%%~1" 2^>nul') do @set "ROS_FOUND=%%f" & exit /b 0
@>&2 echo file "%~1" does not exist in "%ROS_FOUND%"
@exit /b 1
