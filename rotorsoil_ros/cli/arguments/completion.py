"""What a shell has to know to complete verbs, options and their choices: nothing to install."""

import argparse
from argparse import Namespace

from rotorsoil_ros.cli.arguments.parser import parser

_BASH = """\
_rotorsoil() {{
  local words
  if [ "$COMP_CWORD" -eq 1 ]; then
    words="{verbs}"
  else
    case "${{COMP_WORDS[1]}} ${{COMP_WORDS[COMP_CWORD-1]}}" in
{choices}
      *) case "${{COMP_WORDS[1]}}" in
{options}
      esac ;;
    esac
  fi
  COMPREPLY=( $(compgen -W "$words" -- "${{COMP_WORDS[COMP_CWORD]}}") )
}}
complete -o default -F _rotorsoil rotorsoil
"""


def completion(arguments: Namespace) -> int:
    """Print the completion of a shell, as in `source <(rotorsoil completion bash)`."""
    if arguments.shell == 'fish':
        print('\n'.join(_fish()))
    else:
        if arguments.shell == 'zsh':
            print('autoload -Uz compinit bashcompinit && compinit && bashcompinit')
        print(_bash(), end='')
    return 0


def _verbs() -> dict[str, argparse.ArgumentParser]:
    [verbs] = [action for action in parser()._actions
               if isinstance(action, argparse._SubParsersAction)]
    return dict(verbs.choices)


def _bash() -> str:
    verbs = _verbs()
    options, choices = [], []
    for name, verb in verbs.items():
        options.append(f'        {name}) words="{" ".join(verb._option_string_actions)}" ;;')
        for action in verb._actions:
            if action.choices:
                # Behind an option comes its choice; a positional comes behind its verb.
                for before in action.option_strings or [name]:
                    choices.append(f'      "{name} {before}") '
                                   f'words="{" ".join(map(str, action.choices))}" ;;')
    return _BASH.format(verbs=' '.join(verbs), options='\n'.join(options),
                        choices='\n'.join(choices))


def _fish() -> list[str]:
    lines = []
    for name, verb in _verbs().items():
        lines.append(f'complete -c rotorsoil -n __fish_use_subcommand -a {name} '
                     f'-d {_quoted(verb.description or "")}')
        here = f'complete -c rotorsoil -n "__fish_seen_subcommand_from {name}"'
        for action in verb._actions:
            given = ' '.join(map(str, action.choices or ()))
            spelled = ' '.join(f'-l {word[2:]}' if word.startswith('--') else f'-s {word[1:]}'
                               for word in action.option_strings)
            if spelled or given:
                lines.append(' '.join(filter(None, (
                    here, spelled, given and f'-a "{given}"'))))
    return lines


def _quoted(text: str) -> str:
    return "'" + text.replace('\\', '\\\\').replace("'", "\\'") + "'"
